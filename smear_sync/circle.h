#pragma once

#include <optional>
#include <vector>

namespace emberlock::detail {

struct Point {
  double x = 0, y = 0;
};

struct Circle {
  double x = 0, y = 0, radius = 0;
  double sigma = 0;      ///< standard error of x and y
  double agreement = 0;  ///< fraction of the points that lie on it
};

/// The circle that most of an outline's points agree on: bloom and smear stick out of a lamp's disk, the
/// image's edge cuts it, but what is left of the outline still lies on the circle. Geometric least squares
/// over the points within half a pixel, from several starts along y. Nothing for fewer than 8 points.
std::optional<Circle> fit_circle(const std::vector<Point>& outline);

}  // namespace emberlock::detail
