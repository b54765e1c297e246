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

/// When each frame of a clip began to be read: a straight line on a clock that all clips of one strobe share,
/// good beyond the frames that showed it. The line's two errors are independent of one another, but for what
/// the row time is to blame for.
struct ClipTimes {
  double at = 0;         ///< the camera's count (ClipClock::count_of) at which the line is known best
  Seconds start;         ///< of count `at`
  Seconds start_sigma;   ///< standard error
  Seconds period;        ///< from one count to the next
  Seconds period_sigma;  ///< standard error
  /// What start and period owe to a row time one standard error too long; part of the sigmas above. Clips
  /// that were read with one row time err alike by it.
  Seconds start_by_row_time{};
  Seconds period_by_row_time{};
  std::vector<DroppedFrames> drops{};  ///< between places of the file, at which the count jumps

  [[nodiscard]] std::int64_t count_of(std::int64_t place) const;
  /// The place of the file that holds this count; nullopt where that frame was lost.
  [[nodiscard]] std::optional<std::int64_t> place_of(std::int64_t count) const;
  [[nodiscard]] Seconds read_start(std::int64_t place) const;
  /// Standard error of read_start, which grows with the distance from the frames that showed the strobe.
  [[nodiscard]] Seconds sigma(std::int64_t place) const;
  /// What of it the row time is to blame for, with its sign.
  [[nodiscard]] Seconds by_row_time(std::int64_t place) const;
  /// The count whose read phase starts nearest to an instant.
  [[nodiscard]] std::int64_t nearest_count(Seconds instant) const;
};

/// Standard error of how much later one clip's frame is read than another's: of both, less what they share.
Seconds sigma_between(const ClipTimes& a, std::int64_t place_a, const ClipTimes& b, std::int64_t place_b);

/// The times of a clip by its own clock, in the strobe's seconds less a whole number of its flashes: which
/// one, nothing has told yet. There must be a line; its read direction is taken to be the clock's.
ClipTimes strobe_times(const ClipClock& clock);

/// The same where the read direction is known. Errors (bad_input), with `clip` as where: a clock without a
/// phase.
Result<ClipTimes> known_strobe_times(const ClipClock& clock, const ClipOptions& options,
                                     const std::string& clip);

/// The times of a clip by its own clock, in the strobe's seconds since the code's first flash, modulo the
/// code's cycle. The read direction must be known, or given by who read the clock. Errors (bad_input), with
/// `clip` as where: a clock without a phase, or without numbers.
Result<ClipTimes> clip_times(const ClipClock& clock, const ClipOptions& options, const std::string& clip);

/// Moves `times` by whole cycles of the code until its film begins as near to the reference's as may be.
void into_cycle_of(const ClipTimes& reference, const ClipOptions& options, ClipTimes& times);

}  // namespace emberlock::smear
