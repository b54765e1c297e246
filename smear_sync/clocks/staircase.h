// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include <Eigen/Dense>

namespace emberlock::smear {

// All lengths in rows. A flash of `width` rows, x row periods after the start of the read phase, leaves its
// dot u rows from the lamp. u is constant while the flash stays within one row period, and moves on by the
// share of the flash that falls into the next one. For a width of one row or more, u = x - 1/2, without
// steps.

/// The position u of the dot of a flash of `width` rows whose centre is x row periods after the start.
double stair(double x, double width);

/// The x of a flash as given by one dot: mean and deviation over all x that may have caused u, which was
/// measured with `sigma`.
struct StairMoments {
  double mean = 0;
  double sigma = 0;
};
StairMoments invert_stair(double u, double sigma, double width);

/// The unknown: x = place . line, with 2 to 4 parameters, of which the first is a phase.
using StairLine = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1>;

struct StairPoint {
  StairLine place;
  double u = 0;      ///< rows from the lamp
  double sigma = 0;  ///< of the measured u: of dot and lamp
};

struct StairStart {
  StairLine line;              ///< for example the fit of a straight line
  Eigen::MatrixXd covariance;  ///< of the start's errors
  double turn = 0;             ///< T / t_row, at which x wraps; 0: it doesn't
  double width = 0;            ///< of the flash, rows
};

/// Mean and deviation over all lines compatible with the staircase.
struct StairFit {
  StairLine line;
  StairLine sigma;
  double lamp = 0;  ///< common offset of all dots from their steps: the lamp's error modulo one row
};

/// Fits a line to points on its staircase: mean and deviation of the likelihood over all lines near the
/// start. Uses importance sampling that starts with a wide, tempered distribution and narrows step by step.
/// The lamp's constant error is the common offset of all points from the steps, and is removed. Returns
/// nullopt if the points scatter too much to distinguish rows, or the flash is about as long as a row.
std::optional<StairFit> fit_stairs(std::span<const StairPoint> points, const StairStart& start);

}  // namespace emberlock::smear
