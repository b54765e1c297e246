// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <math.h>

#include "base/host_device.h"

namespace emberlock::recon {

/// The phase function of Henyey and Greenstein (1941), 1/sr, the paper's equation (9):
///   p(mu) = (1 - g^2) / (4 pi (1 + g^2 - 2 g mu)^(3/2))
/// mu is the cosine of the angle between the light's directions of travel before and after. g > 0 scatters
/// forwards, and the mean of mu is g; the paper's g has the opposite sign. |g| < 1; 0 is isotropic.
template <class Real>
struct HenyeyGreenstein {
  Real g = 0;

  /// The denominator is written as (1 - |g|)^2 + 2 |g| (1 -+ mu), which avoids cancellation near its peak.
  [[nodiscard]] HOST_DEVICE Real operator()(Real mu) const {
    constexpr Real kInverseSphere = Real(0.079577471545947668);  // 1 / (4 pi)
    const Real a = g < 0 ? -g : g;
    const Real away = g < 0 ? 1 + mu : 1 - mu;
    const Real d = (1 - a) * (1 - a) + 2 * a * (away > 0 ? away : Real(0));
    return kInverseSphere * (1 - a) * (1 + a) / (d * sqrt(d));
  }

  /// The cosine at which the cumulative probability is u in [0, 1]. With s = 2 u - 1, the usual inverse (1 +
  /// g^2 - ((1 - g^2) / (1 + g s))^2) / (2 g) is rewritten without the division by g, so that it also holds
  /// for g = 0.
  [[nodiscard]] HOST_DEVICE Real sample(Real u) const {
    const Real s = 2 * u - 1;
    const Real g2 = g * g;
    const Real d = 1 + g * s;
    const Real mu = (s * (1 + g2) + Real(0.5) * g * (s * s * (1 + g2) + 3 - g2)) / (d * d);
    return mu < -1 ? Real(-1) : (mu > 1 ? Real(1) : mu);
  }
};

}  // namespace emberlock::recon
