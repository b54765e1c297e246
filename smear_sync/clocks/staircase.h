// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include <Eigen/Dense>

namespace emberlock::smear {

// All in rows: a flash of `width` rows about x row periods after the start of the read phase leaves its dot u
// rows from the lamp, where u stands still while the flash stays within one row period and moves over by the
// share of it that falls into the next one. From a width of one row on, u = x - 1/2: no stairs.

/// Where the dot stands of a flash of `width` rows whose centre comes x row periods after the start.
double stair(double x, double width);

/// A flash's x as one dot tells it: mean and deviation over all x that may have put it at u, read with
/// `sigma`.
struct StairMoments {
  double mean = 0;
  double sigma = 0;
};
StairMoments invert_stair(double u, double sigma, double width);

/// What is looked for: x = place . line, of 2 to 4 numbers, a phase first.
using StairLine = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;

struct StairPoint {
  StairLine place;
  double u = 0;      ///< rows from the lamp
  double sigma = 0;  ///< of u as read: of dot and lamp
};

struct StairStart {
  StairLine line;              ///< a straight line's fit, say
  Eigen::MatrixXd covariance;  ///< how far off it may be
  double turn = 0;             ///< T / t_row, where x goes round; 0: it doesn't
  double width = 0;            ///< of the flash, rows
};

/// Mean and deviation of what the stairs leave possible.
struct StairFit {
  StairLine line;
  StairLine sigma;
  double lamp = 0;  ///< by which all dots miss their steps: the lamp's error, but for whole rows
};

/// The line whose stairs the points stand on: mean and deviation of the likelihood over all lines near the
/// start, by importance sampling that starts wide and melted and narrows as it hardens. The lamp's own
/// constant error is what all points miss the stairs by, and is taken out. Nothing when the points scatter so
/// far that rows can't be told apart, or the flash is about as long as a row.
std::optional<StairFit> fit_stairs(std::span<const StairPoint> points, const StairStart& start);

}  // namespace emberlock::smear
