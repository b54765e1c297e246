// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

/// What one frame showed, by the camera's own count of frames.
struct FrameReading {
  std::int64_t frame = 0;  ///< frames that weren't delivered are gaps; a count that hides one misleads
  SmearReading reading;
};

struct ReadModeOptions {
  Hertz flash_rate{24.2};                             ///< f, of the strobe
  Hertz frame_rate{23.976};                           ///< 1 / T, as believed
  PartsPerMillion rate_sigma{30};                     ///< standard error of f T: of both clocks together, > 0
  SecondsPerRow row_time = microseconds_per_row(54);  ///< t_row, of a comb
  SecondsPerRow row_time_sigma = SecondsPerRow(5e-9);  ///< its standard error
  int rows = 720;                                      ///< n
};

/// How a camera reads its chip, told from how dots walk.
struct ReadMode {
  std::optional<ReadDirection> direction;  ///< d; absent where the walk is too short to tell
  std::string direction_reason;            ///< what was seen, or why d isn't known and what would tell it

  std::optional<int> shifts;  ///< K; absent where several values fit
  std::string shifts_reason;  ///< what was seen, or why K isn't known and what would tell it
  Rows shifts_measured{};     ///< K before it was rounded; modulo shifts_modulo. Zero where none was measured
  Rows shifts_sigma{};        ///< its standard error
  Rows shifts_modulo{};       ///< the flashes' distance, P / t_row

  /// The camera's frame rate against the one believed, both measured by the strobe. Absent without d.
  std::optional<PartsPerMillion> frame_rate_error;
  PartsPerMillion frame_rate_sigma{};  ///< standard error
  Rows residual{};                     ///< RMS of the dots about the walk that d explains
  int dots = 0;                        ///< used
  int frames = 0;                      ///< they stand in
};

/// Tells d and K from flashes that are not in step with the frames: one a frame from a strobe detuned by some
/// rows a second, or a comb, whose dots walk by what is left of T / P. Read phase i begins at t_0 + i T, so
/// its flashes stand at tau = phi - i T modulo the flash period P = 1 / f; a dot stands d tau / t_row rows
/// from its lamp, or K rows less once it wrapped. Both directions are fitted, each with the frame rate free
/// within three rate_sigma; d is known when one explains the dots and the other doesn't, and not where that
/// one wants a rate beyond (a strobe so near a whole rate of the frames' that a wrong one may seem to walk).
/// The two sides of the lamp then differ by K - T / t_row modulo P / t_row rows, and K is known when one
/// whole number from n to T / t_row fits: so a comb of 300 flashes a second tells d and K of most cameras in
/// a second, a single dot K once it was seen on both sides.
///
/// Readings with dots (states `dot` and `comb`) are used, others passed over; stray dots are outvoted. With
/// sweep-out dots are seen on one side only, and K stays unknown (and isn't needed). Errors (bad_input):
/// rates, row time or rows that aren't positive and finite.
Result<ReadMode> find_read_mode(std::span<const FrameReading> frames, const ReadModeOptions& options);

}  // namespace emberlock::smear
