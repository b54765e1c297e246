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

/// The reading of one frame, with the camera's frame number.
struct FrameReading {
  std::int64_t frame = 0;  ///< undelivered frames must be gaps; an unreported loss falsifies the result
  SmearReading reading;
};

struct ReadModeOptions {
  Hertz flash_rate{24.2};                             ///< f, of the strobe
  Hertz frame_rate{23.976};                           ///< 1 / T, approximately
  PartsPerMillion rate_sigma{30};                     ///< standard error of f T: of both clocks together, > 0
  SecondsPerRow row_time = microseconds_per_row(54);  ///< t_row, measured with a comb
  SecondsPerRow row_time_sigma = SecondsPerRow(5e-9);  ///< its standard error
  int rows = 720;                                      ///< n
};

/// How a camera reads its sensor, determined from the walk of the dots.
struct ReadMode {
  std::optional<ReadDirection> direction;  ///< d; absent if the walk is too short to tell
  std::string direction_reason;            ///< the observation; or why d isn't known and how to find it

  std::optional<int> shifts;  ///< K; absent if several values fit
  std::string shifts_reason;  ///< the observation; or why K isn't known and how to find it
  Rows shifts_measured{};     ///< K before rounding; modulo shifts_modulo. Zero if not measured
  Rows shifts_sigma{};        ///< its standard error
  Rows shifts_modulo{};       ///< the distance of two flashes, P / t_row

  /// Deviation of the camera's frame rate from the assumed one, measured with the strobe. Absent without d.
  std::optional<PartsPerMillion> frame_rate_error;
  PartsPerMillion frame_rate_sigma{};  ///< standard error
  Rows residual{};                     ///< RMS deviation of the dots from the walk with this d
  int dots = 0;                        ///< number of dots used
  int frames = 0;                      ///< number of frames with these dots
};

/// Determines d and K from flashes that aren't synchronous with the frames: one flash per frame from a strobe
/// detuned by some rows per second, or a comb, whose dots walk by the fractional part of T / P. Read phase i
/// begins at t_0 + i T, so its flashes are at tau = phi - i T modulo the flash period P = 1 / f. A dot is d
/// tau / t_row rows from its lamp, or K rows less if it wrapped. Both directions are fitted, each with the
/// frame rate free within three rate_sigma. d is known when one direction explains the dots and the other
/// doesn't, but not if that one needs a frame rate outside the range (when the flash rate is close to a
/// multiple of the frame rate, the wrong direction may also seem to walk). The two sides of the lamp differ
/// by K - T / t_row modulo P / t_row rows; K is known when exactly one integer from n to T / t_row fits. So a
/// comb of 300 flashes per second gives d and K of most cameras within a second; a single dot gives K once it
/// was seen on both sides.
///
/// Uses readings with dots (states `dot` and `comb`) and ignores the others; stray dots are outvoted. With
/// sweep-out, dots appear on one side only; K then stays unknown (and isn't needed). Errors (bad_input):
/// rates, row time or rows that aren't positive and finite.
Result<ReadMode> find_read_mode(std::span<const FrameReading> frames, const ReadModeOptions& options);

}  // namespace emberlock::smear
