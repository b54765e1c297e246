// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/result.h"

namespace emberlock::evaluate {

// What a rig will see of a flame, by a law of few parameters that is fitted to a few simulated rigs (twin.h).
// Pure: numbers in, numbers out.

/// A rig as its error depends on it. Lengths are in heights of the flame, so that a flame of another size,
/// filmed from as much farther away, is the same one.
struct TwinRig {
  std::vector<Eigen::Vector3d> towards;  ///< from the flame to each camera, unit length; z is up
  double pixel = 0.01;                   ///< edge of a pixel where the flame is
  double noise = 0;                      ///< RMS of a pixel, grey levels, the flame's brightest being 230
  double exposed = 0;                    ///< by how much the flame rises during an exposure
  double late = 0;  ///< and within the cameras' tolerance, to either side of their common instant
};

/// What an error is made of. Their squares add up.
enum class ErrorPart : std::uint8_t { views, pixels, noise, exposure, sync, rest };
inline constexpr std::size_t kErrorParts = 6;
inline constexpr std::array<ErrorPart, kErrorParts> kAllErrorParts{ErrorPart::views, ErrorPart::pixels,
                                                                   ErrorPart::noise, ErrorPart::exposure,
                                                                   ErrorPart::sync,  ErrorPart::rest};
std::string_view name(ErrorPart part);

/// Squares of grey levels, by part.
using ErrorSquares = std::array<double, kErrorParts>;
/// The error: the root of their sum.
double total(const ErrorSquares& squares);

/// Where a rig is judged from: twelve directions all around, at most 15 degrees above or below the flame.
std::vector<Eigen::Vector3d> judge_directions();

/// How much of the judges' pictures the cameras leave open, 0..1: never more with one camera more. By
/// the Fourier slice theorem (Bracewell 1956) a picture tells the flame's spatial frequencies on the plane
/// across its direction, and as the flame is finite, what it tells is correlated with its neighbourhood, by
/// exp(-d^2 / 2) at a distance d. What remains of a judge's frequency is the variance of its best linear
/// estimate from the cameras' nearest ones (kriging: Matheron 1963). `reach`: the frequency that stands for
/// all, in units of that neighbourhood. Opposite cameras share a plane, so the second tells little: what of
/// the flame outshines the rest on its own side.
double unseen(const std::vector<Eigen::Vector3d>& towards, double reach);

/// E^2 = sum strength_i basis_i(rig), with the bases unseen(), pixel^2, noise^2 / cameras, exposed^2,
/// late^2 / (1 + (late / 0.08)^2), as what is late by more is another flame, and 1.
struct ErrorLaw {
  double reach = 1;
  ErrorSquares strength{};
  double spread =
      0;  ///< RMS of predicted / measured - 1 of rigs that were left out of the fit, one at a time
};

/// RMS by which the law missed rigs that differ from those of a sweep in several things at once: five rigs
/// with three flames (docs/design.md).
inline constexpr double kJointSpread = 0.10;
/// Standard error of a predicted error, relative to it: `spread` and that.
double uncertainty(const ErrorLaw& law);

/// Errors with their parts, grey levels.
ErrorSquares predict(const ErrorLaw& law, const TwinRig& rig);

struct MeasuredRig {
  TwinRig rig;
  double error = 0;  ///< grey levels, > 0
};

/// Least squares of E^2 relative to what was measured: strengths that aren't negative, and the reach of a
/// ladder. Errors (bad_input): fewer rigs than kErrorParts + 2, no cameras, errors that aren't positive and
/// finite.
Result<ErrorLaw> fit_error_law(const std::vector<MeasuredRig>& rigs);

/// The exposure, as a rise of the flame in its heights, at which noise and motion blur together are least,
/// where `noise` is that of a rise of 1 and falls with the root of the exposure. Infinite where the law knows
/// no blur.
double balanced_exposure(const ErrorLaw& law, std::size_t cameras, double noise);

/// Directions of `cameras` that all tell a plane of their own: camera k at an azimuth of k (180 + 180 / n)
/// degrees, which for odd n is the ring; neighbours alternately 10 degrees above and below.
std::vector<Eigen::Vector3d> even_planes(int cameras);

}  // namespace emberlock::evaluate
