// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "smear_sync/align/align.h"

namespace emberlock::smear {

/// Where a target stands at an instant, strobe_phase taken out.
Seconds target_at(const AlignTarget& target, TimePoint at, Seconds period);

/// One step of the phase-locked loop: plans the target anew while trims are on their way to it, holds it once
/// the last is near, and gives every camera its servo's state, its trim where that changes, and its reason.
/// Every camera can be trimmed, and its phase is known. True when all are within tolerance by two standard
/// errors; the trims given then hold them there. The outermost cameras are to be reset (`reset` is set) where
/// trims would take longer than options.trim_time in all.
bool trim_rates(AlignState& state, AlignDecision& decision, const AlignRound& round,
                const std::vector<AlignCamera>& cameras, const AlignOptions& options);

}  // namespace emberlock::smear
