// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/image.h"

namespace emberlock::smear::detail {

struct Point {
  double x = 0, y = 0;
};

struct Circle {
  double x = 0, y = 0, radius = 0;
  double sigma = 0;      ///< standard error of x and y
  double agreement = 0;  ///< fraction of its circumference inside the image on which the outline lies
};

/// The circle with most of its circumference on the outline: bloom and smear stick out of a lamp's disk, the
/// image's edge cuts it, but what is left of the outline still lies on the circle. Geometric least squares
/// over the points within half a pixel, from several starts along y. Nothing for fewer than 8 points. `image`
/// is what the outline was drawn in.
std::optional<Circle> fit_circle(const std::vector<Point>& outline, ImageSize image);

}  // namespace emberlock::smear::detail
