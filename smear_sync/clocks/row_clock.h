// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>

#include "base/result.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

/// The sensor's row time, measured with a comb of dots.
struct RowClock {
  SecondsPerRow row_time;  ///< t_row
  SecondsPerRow sigma;  ///< its standard error, including the effect of rounding to whole rows at this pitch
  Rows pitch;           ///< p = 1 / (f t_row), between neighbouring dots
  int dots = 0;         ///< number used, without outliers
  int frames = 0;       ///< with two or more dots on one side of the lamp
  /// The pitch is so close to an integer number of rows that every dot may have the same rounding error,
  /// because charge moves in whole rows. t_row may then be off by more than sigma. Change the flash rate by a
  /// percent and measure again.
  bool near_integer_pitch = false;
  /// K modulo the pitch, from the distance of dots across the lamp; needs a frame period and dots on both
  /// sides.
  std::optional<Rows> shifts_modulo_pitch;
};

/// t_row = 1 / (p f): least squares fit of the pitch to all dots of all frames in state `comb` (the paper's
/// equation (2), with more than two dots). Each frame has its own phase, and the two sides of the lamp have
/// an offset common to all frames: nothing is assumed about K. Gaps of several pitches (missed dots) and
/// outliers are allowed. flash_rate is in flashes per second. If the frames prove to be one uninterrupted
/// walk of the comb (none lost, even flashes), they are fitted together, with the staircase that whole-row
/// shifts cause for flashes of `flash_width`: this is four times as accurate.
///
/// Errors (bad_input): a flash rate that isn't positive and finite; fewer than three dots on one side of the
/// lamp in every frame; dots without a regular pitch.
Result<RowClock> fit_row_clock(std::span<const SmearReading> frames, Hertz flash_rate,
                               std::optional<Seconds> frame_period = std::nullopt,
                               Seconds flash_width = microseconds(20));

}  // namespace emberlock::smear
