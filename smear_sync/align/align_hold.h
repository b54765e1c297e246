// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "smear_sync/align/align.h"
#include "smear_sync/align/align_choice.h"
#include "smear_sync/align/align_context.h"

// Holding what was reached: how long every camera stays in tolerance, and who is reset before it leaves.
namespace emberlock::smear {

/// How the cameras' errors move against a target that goes as the middle of them does, or as the reference or
/// the held target does; every camera's error is known. Trims ordered count as in force.
std::vector<Drift> courses_of(const AlignState& state, const AlignDecision& decision,
                              const std::vector<Drift>& drifts, const AlignContext& c);

/// The error at which a timed reset aims: on the side from which the drift leads the camera through the whole
/// tolerance, as far out as the reset surely still lands within; nearer to the target the slower it drifts
/// and the less that is known.
Seconds aim_of(const Drift& course, Seconds landing, const AlignContext& c);

/// All cameras are within tolerance: has those reset that are about to leave it, and by timed resets with
/// them those that would leave before the next can be needed, so that few moments are spent on it. Nobody who
/// can't be reset is. False when it is nobody's time.
bool renew(AlignState& state, AlignDecision& decision, const std::vector<Drift>& courses,
           const AlignContext& c, const AlignScene& scene);

/// The cameras whose drift must be known better before anybody can say whether they stay for the shortest
/// take.
std::vector<std::size_t> unknown_drifts(const std::vector<Drift>& courses, const AlignContext& c);

/// Those that may have left before another round is filmed.
std::vector<std::size_t> leaving_at_once(const std::vector<Drift>& courses, const AlignContext& c);

/// For how long all would surely stay if they were reset now; absent where resets can't be aimed and would
/// have to be.
std::optional<Seconds> renewed_stay(const std::vector<Drift>& courses, const AlignContext& c,
                                    const AlignScene& scene);

/// Whether the renewal under way goes on: nothing but what it reset is missing or out of tolerance.
void follow_renewal(AlignState& state, AlignDecision& decision, const AlignContext& c);

/// How long every camera stays, and of aligned cameras when to film again.
void foresee(const AlignState& state, AlignDecision& decision, const std::vector<Drift>& drifts,
             const AlignContext& c);

}  // namespace emberlock::smear
