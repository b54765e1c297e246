// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "smear_sync/clocks/read_mode.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::smear {

/// The range of K for a camera with this number of rows and this frame period.
struct ShiftsRange {
  int least = 0, most = 0;
};
ShiftsRange possible_shifts(const CcdTiming& timing);

/// Fits the line through a clip's dots. Sets clock.line, points, timing.shifts, tau_slack, T and its error,
/// the state, and the reason if there is no line. Wrapped dots are K rows off the others. If K is known, all
/// dots are used. If the dots' walk leaves a few values of K open, each gives a line with a probability; the
/// result is their mean, with the resulting deviation. If nothing is known of K, only the dots on the side
/// with more of them are used, and tau_slack is the uncertainty that K causes if those had wrapped. `frames`
/// must all have the lamp at row clock.lamp; clock.mode, timing and numbers contain what is known so far.
void find_line(std::span<const FrameReading> frames, const ClipOptions& options, ClipClock& clock);

}  // namespace emberlock::smear
