// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include <math.h>

#include "base/host_device.h"

namespace emberlock::recon {

/// Functions of the C library: unlike <cmath>'s overloads they aren't inline functions of this program.
HOST_DEVICE inline float exp_of(float x) { return expf(x); }
HOST_DEVICE inline double exp_of(double x) { return exp(x); }
HOST_DEVICE inline float expm1_of(float x) { return expm1f(x); }
HOST_DEVICE inline double expm1_of(double x) { return expm1(x); }
HOST_DEVICE inline float sqrt_of(float x) { return sqrtf(x); }
HOST_DEVICE inline double sqrt_of(double x) { return sqrt(x); }

// The extinction as policies of the march, selected once on the host, so that the code contains no trace of
// the others. x is the optical depth of a step, sigma ds; phi(x) = (1 - exp(-x)) / x.

/// phi(x) and its derivative by their series: single precision for 0 <= x <= 0.5, double precision for x <=
/// 1e-3. Without branches and calls, so that loops over it are vectorized.
template <class Real>
HOST_DEVICE inline Real phi_series(Real x) {
  constexpr Real c2 = Real(1.0 / 2), c3 = Real(1.0 / 6), c4 = Real(1.0 / 24), c5 = Real(1.0 / 120),
                 c6 = Real(1.0 / 720), c7 = Real(1.0 / 5040);
  return 1 - x * (c2 - x * (c3 - x * (c4 - x * (c5 - x * (c6 - x * c7)))));
}
template <class Real>
HOST_DEVICE inline Real phi_slope_series(Real x) {
  constexpr Real c2 = Real(1.0 / 2), c3 = Real(1.0 / 3), c4 = Real(1.0 / 8), c5 = Real(1.0 / 30),
                 c6 = Real(1.0 / 144), c7 = Real(1.0 / 840), c8 = Real(1.0 / 5760);
  return -c2 + x * (c3 - x * (c4 - x * (c5 - x * (c6 - x * (c7 - x * c8)))));
}
/// The largest depth for the series.
template <class Real>
HOST_DEVICE constexpr Real series_limit() {
  return sizeof(Real) == sizeof(float) ? Real(0.5) : Real(0.01);
}

template <class Real>
HOST_DEVICE inline Real phi(Real x) {
  if (x < series_limit<Real>()) return phi_series(x);
  return -expm1_of(-x) / x;
}
template <class Real>
HOST_DEVICE inline Real phi_slope(Real x) {
  if (x < series_limit<Real>()) return phi_slope_series(x);
  return (exp_of(-x) * (1 + x) - 1) / (x * x);
}

/// No extinction: the transmittance isn't computed at all.
template <class Real>
struct NoExtinction {
  static constexpr bool kField = false;
  [[nodiscard]] HOST_DEVICE Real at(Real /*length*/) const { return 1; }
  [[nodiscard]] HOST_DEVICE Real over(Real /*step*/) const { return 1; }
  [[nodiscard]] HOST_DEVICE Real over(Real /*step*/, std::uint32_t /*steps*/) const { return 1; }
  [[nodiscard]] HOST_DEVICE Real weight(Real step) const { return step; }
};

/// Constant inside the medium: `sigma` per voxel edge.
template <class Real>
struct ConstantExtinction {
  static constexpr bool kField = false;
  Real sigma = 0;
  [[nodiscard]] HOST_DEVICE Real at(Real length) const { return exp_of(-sigma * length); }
  [[nodiscard]] HOST_DEVICE Real over(Real step) const { return 1 - sigma * step * phi(sigma * step); }
  /// The product over several steps, as the march makes it: exp(-sigma ds steps) differs where steps are
  /// thick.
  [[nodiscard]] HOST_DEVICE Real over(Real step, std::uint32_t steps) const {
    Real product = 1;
    for (Real power = over(step); steps > 0; steps >>= 1, power *= power)
      if ((steps & 1) != 0) product *= power;
    return product;
  }
  /// ds * phi(sigma ds)
  [[nodiscard]] HOST_DEVICE Real weight(Real step) const { return step * phi(sigma * step); }
};

/// Lane 3 of the volume, per voxel edge, trilinear between key points.
template <class Real>
struct FieldExtinction {
  static constexpr bool kField = true;
};

}  // namespace emberlock::recon
