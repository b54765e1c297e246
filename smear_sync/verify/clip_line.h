// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "smear_sync/clocks/read_mode.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::smear {

/// The least K that a camera of so many rows may have, and the most that its frame period has room for.
struct ShiftsRange {
  int least = 0, most = 0;
};
ShiftsRange possible_shifts(const CcdTiming& timing);

/// Puts the line through a clip's dots: clock.line, points, timing.shifts, tau_slack, T and its error, the
/// state, and the reason where there is no line. Dots that wrapped stand K rows off the others. Where K is
/// known, all are used. Where the dots' walk leaves a few K open, each has its line and its probability, and
/// the line is their mean, with the deviation that they leave. Where it tells nothing of K, only the dots of
/// the side that most stand on are used, and tau_slack is what K leaves open of those that wrapped.
/// `frames`: all of one lamp, whose row clock.lamp is; clock.mode, timing and numbers are what is known so
/// far.
void find_line(std::span<const FrameReading> frames, const ClipOptions& options, ClipClock& clock);

}  // namespace emberlock::smear
