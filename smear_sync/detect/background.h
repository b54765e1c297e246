// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

/// The frame away from lamp and dots, in samples of the plane.
struct Background {
  double level = 0;
  double noise = 0;       ///< standard deviation of a pixel, at least that of rounding
  double saturation = 0;  ///< from here on a pixel counts as saturated: just below white, or below the
                          ///< plateau of a signal that was clipped at fewer bits (12 bits in a 16-bit file)
  double step = 1;        ///< quantisation step of the signal, in grey levels of the frame: more than 1 where
                          ///< fewer bits lie in a deeper file
  double grey = 1;   ///< 1/255 of white per sample of the plane: a codec's errors are in proportion to white,
                     ///< whatever the depth of the file
  double grain = 1;  ///< noise of a sum of 6 x 6 neighbours, relative to that of independent pixels
  bool compressed =
      false;  ///< quantised by a compressor (or noiseless): the noise doesn't indicate the size of artefacts
  bool flat = false;  ///< compressed so strongly that no noise is left
};
/// Measured in runs of 36 pixels all over the frame. Doesn't set `saturation`, which needs the brightest
/// rows.
Background measure_background(const Plane& plane, int runs = 64);
/// Sets `saturation`. In a compressed frame step and noise become at least those of 8 bits: the codec's
/// errors hide finer ones.
void set_saturation(const Plane& plane, double saturation, Background& background);
/// The part of white from which on a sample counts as saturated.
constexpr double kNearlyWhite = 0.98;

/// Every row, or one field of an interlaced frame.
struct Field {
  int first = 0, step = 1;
};
/// The approximate median of each of the patch's columns, padding included: nested medians of three over 81
/// rows of the field.
std::vector<float> column_medians(const Patch& patch, Field field);

float median(std::span<float> values);  ///< reorders; 0 if empty
/// Ratio of sigma to the median absolute value of a normal distribution.
constexpr double kMadSigma = 1.4826;
/// kMadSigma times the median absolute value; reorders.
double robust_scale(std::span<float> values);

}  // namespace emberlock::smear::detail
