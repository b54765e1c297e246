// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "smear_sync/align/align_context.h"

namespace emberlock::smear {

/// Cameras whose shutters somebody reset since the round before, as far as this one shows: their phase is
/// six standard errors and a tenth of the tolerance from where it was to be, in another way than most
/// cameras' and than a reflection's, or gone though nothing was to hide it. Phases that moved all alike are
/// the strobe's doing. Comes before the round's phases are taken over; cameras reset by order, away or in
/// doubt aren't judged.
std::vector<std::size_t> unordered_resets(const AlignState& state, const AlignContext& c);

/// Whether a phase that was lost turned up where it would be without a reset.
bool same_phase(Seconds shift, Seconds sigma, const AlignContext& c);

}  // namespace emberlock::smear
