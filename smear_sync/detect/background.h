// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

/// What the frame looks like away from lamp and dots, in samples of the plane.
struct Background {
  double level = 0;
  double noise = 0;  ///< standard deviation a pixel, at least that of rounding
  double saturation =
      0;  ///< from here on a pixel counts as saturated: just below white, or below the plateau of a
          ///< signal that is clipped in a deeper container (12 bits in a 16-bit file)
  double grain = 1;         ///< noise of the sum of 6 x 6 neighbours, over that of independent pixels
  bool compressed = false;  ///< by a quantiser (or noiseless): noise says little about artefacts
  bool flat = false;        ///< and so far that no noise is left
};
/// From runs of 36 pixels all over the frame; all but `saturation`, which its brightest rows tell.
Background measure_background(const Plane& plane, int runs = 64);

/// Every row, or one field of an interlaced frame.
struct Field {
  int first = 0, step = 1;
};
/// About the median of each of the patch's columns, padding included: medians of three of medians of three,
/// from 81 rows all over the field.
std::vector<float> column_medians(const Patch& patch, Field field);

float median(std::span<float> values);  ///< reorders; 0 for none
/// A normal value's sigma over its median absolute value.
constexpr double kMadSigma = 1.4826;
/// kMadSigma times the median absolute value; reorders.
double robust_scale(std::span<float> values);

}  // namespace emberlock::smear::detail
