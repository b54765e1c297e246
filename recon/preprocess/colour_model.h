// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "recon/preprocess/colour.h"

namespace emberlock::recon {

/// ln g(v) = p0 ln v + p1 (1 - v) + p2 (1 - v)^2 + p3 (1 - v)^3: always g(1) = 1, and a power law if the last
/// three are 0.
struct ResponseCurve {
  static constexpr int kParameters = 4;
  static constexpr double kLeastSample = 1e-4;

  /// ln of the mean of g over samples of this mean and variance, to second order.
  template <class T>
  static T log_exposure(const T* p, double v, double variance) {
    using std::log;
    const double u = 1 - v;
    const T q = p[0] * std::log(v) + u * (p[1] + u * (p[2] + u * p[3]));
    const T slope = p[0] / v - (p[1] + u * (2.0 * p[2] + u * 3.0 * p[3]));
    const T bend = -p[0] / (v * v) + 2.0 * p[2] + u * 6.0 * p[3];
    T more = 1.0 + 0.5 * variance * (bend + slope * slope);
    if (more < 0.5) more = T(0.5);
    return q + log(more);
  }
  /// d ln g / d ln v
  template <class T>
  static T log_slope(const T* p, double v) {
    const double u = 1 - v;
    return p[0] - v * (p[1] + u * (2.0 * p[2] + u * 3.0 * p[3]));
  }
  static double exposure(const std::array<double, kParameters>& p, double v) {
    return v <= kLeastSample ? 0 : std::exp(log_exposure(p.data(), v, 0.0));
  }
};

}  // namespace emberlock::recon
