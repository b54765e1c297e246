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
  double agreement = 0;  ///< share of its circumference inside the image that lies on the outline
};

/// Finds the circle with most of its circumference on the outline. Bloom and smear extend beyond a lamp's
/// disk, and the image's edge cuts it, but the rest of the outline still lies on the circle. Geometric least
/// squares over the points within half a pixel, from several starts along y. nullopt for fewer than 8 points.
/// `image` is the size of the image with the outline.
std::optional<Circle> fit_circle(const std::vector<Point>& outline, ImageSize image);

}  // namespace emberlock::smear::detail
