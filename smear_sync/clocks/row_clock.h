// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "base/result.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

/// What a comb of dots says about the sensor's clock.
struct RowClock {
  SecondsPerRow row_time;  ///< t_row
  SecondsPerRow sigma;     ///< its standard error, with what rounding to whole rows may do to this pitch
  Rows pitch;              ///< p = 1 / (f t_row), between neighbouring dots
  int dots = 0;            ///< used; outliers are left out
  int frames = 0;          ///< that had two dots or more on one side of the lamp
  /// The pitch is so near a whole number of rows that charge, which moves in whole rows, may show the same
  /// rounding in every dot: t_row may be off by more than sigma. Change the flash rate by a percent and
  /// measure again.
  bool near_integer_pitch = false;
  /// K modulo the pitch, from the spacing across the lamp; when a frame period was given and dots stand on
  /// both sides.
  std::optional<Rows> shifts_modulo_pitch;
};

/// t_row = 1 / (p f): least squares for the pitch over all dots of all frames whose state is `comb` (the
/// paper's equation (2), over more than two dots). Each frame has its own phase and the two sides
/// of the lamp their own offset, common to all frames: nothing is assumed about K. Gaps of several pitches
/// (missed dots) and outliers are allowed; flash_rate is the strobe's, in flashes a second. Where the frames
/// prove to be one walk of the comb (none was lost, the strobe is even), they are fitted as one, through the
/// stairs that whole rows make of flashes of `flash_width`: four times as exact.
///
/// Errors (bad_input): a flash rate that isn't positive and finite; fewer than three dots on one side of the
/// lamp in every frame, or dots that stand in no regular pitch.
Result<RowClock> fit_row_clock(std::span<const SmearReading> frames, Hertz flash_rate,
                               std::optional<Seconds> frame_period = std::nullopt,
                               Seconds flash_width = microseconds(20));

}  // namespace emberlock::smear
