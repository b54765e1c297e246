// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

namespace emberlock::smear {

struct LinePoint {
  double t = 0;
  double y = 0;
  double weight = 0;  ///< 1 / sigma^2
};

/// y = level + rate (t - middle). `middle` is the weighted mean of t, where the errors of level and rate are
/// independent.
struct WeightedLine {
  double middle = 0;
  double level = 0;
  double rate = 0;
  double level_variance = 0;
  double rate_variance = 0;  ///< not finite (like rate) if all points have the same t
};

/// Weighted least squares. Needs at least one point and weights > 0.
inline WeightedLine weighted_line(std::span<const LinePoint> points) {
  double w = 0;
  double wt = 0;
  double wy = 0;
  for (const LinePoint& p : points) {
    w += p.weight;
    wt += p.weight * p.t;
    wy += p.weight * p.y;
  }
  WeightedLine line{wt / w, wy / w, 0, 1 / w, 0};
  double tt = 0;
  double ty = 0;
  for (const LinePoint& p : points) {
    const double t = p.t - line.middle;
    tt += p.weight * t * t;
    ty += p.weight * t * (p.y - line.level);
  }
  line.rate = ty / tt;
  line.rate_variance = 1 / tt;
  return line;
}

}  // namespace emberlock::smear
