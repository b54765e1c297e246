// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "smear_sync/clocks/frame_code.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::smear {

/// The start of each frame's read phase in a clip: a straight line on a clock common to all clips of one
/// strobe. It also holds outside the part that shows the strobe. The line's two errors are independent of
/// each other, except for the contribution of the row time.
struct ClipTimes {
  double at = 0;         ///< the camera's count (ClipClock::count_of) at which the line is most accurate
  Seconds start;         ///< of count `at`
  Seconds start_sigma;   ///< standard error
  Seconds period;        ///< from one count to the next
  Seconds period_sigma;  ///< standard error
  /// Change of start and period if the row time is one standard error too long; included in the sigmas above.
  /// Clips read with the same row time share this error.
  Seconds start_by_row_time{};
  Seconds period_by_row_time{};
  std::vector<DroppedFrames> drops{};  ///< between frames of the file, where the count jumps

  [[nodiscard]] std::int64_t count_of(std::int64_t place) const;
  /// The index in the file of this count; nullopt if that frame was lost.
  [[nodiscard]] std::optional<std::int64_t> place_of(std::int64_t count) const;
  [[nodiscard]] Seconds read_start(std::int64_t place) const;
  /// Standard error of read_start; it grows with the distance from the frames that showed the strobe.
  [[nodiscard]] Seconds sigma(std::int64_t place) const;
  /// The contribution of the row time to it, with its sign.
  [[nodiscard]] Seconds by_row_time(std::int64_t place) const;
  /// The count whose read phase starts closest to an instant.
  [[nodiscard]] std::int64_t nearest_count(Seconds instant) const;
};

/// Standard error of the delay between a frame of one clip and one of another: of both, without their common
/// error.
Seconds sigma_between(const ClipTimes& a, std::int64_t place_a, const ClipTimes& b, std::int64_t place_b);

/// A clip's times on its own clock, in seconds of the strobe, up to an unknown integer number of flashes.
/// Requires a line; uses the clock's read direction.
ClipTimes strobe_times(const ClipClock& clock);

/// The same if the read direction is known. Errors (bad_input, with `clip` as where): a clock without a
/// phase.
Result<ClipTimes> known_strobe_times(const ClipClock& clock, const ClipOptions& options,
                                     const std::string& clip);

/// A clip's times on its own clock, in seconds of the strobe since the code's first flash, modulo the code's
/// cycle. The read direction must be known, or have been given when the clock was read. Errors (bad_input,
/// with `clip` as where): a clock without a phase or without numbers.
Result<ClipTimes> clip_times(const ClipClock& clock, const ClipOptions& options, const std::string& clip);

/// Shifts `times` by whole cycles of the code so that its film begins as close to the reference's as
/// possible.
void into_cycle_of(const ClipTimes& reference, const ClipOptions& options, ClipTimes& times);

}  // namespace emberlock::smear
