// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "smear_sync/align/align.h"

namespace emberlock::smear {

/// The standard deviation of one reset's delay about its camera's mean: what is told, weighed as four
/// resets, joined with what resets have shown.
Seconds learnt_jitter(const AlignState& state, const AlignOptions& options);

/// Takes in the delay that a camera's reset has shown, weighed with what was expected by their variances, on
/// the circle. An observation that the expectation excludes (five standard deviations) replaces it: the
/// expectation was wrong.
void learn_delay(AlignState& state, const std::vector<AlignCamera>& cameras, const AlignOptions& options,
                 std::size_t camera, Seconds observed);

/// The delay to expect of a camera's next reset: its own if a reset has taught it, else that of the cameras
/// of its model that have been taught, else what was known before; absent when nothing is known. How alike
/// the cameras of a model are is learnt with it: their spread may be of any size (log-uniform between 0.05
/// and 12.8 ms), and each size counts as much as the delays taught bear it out.
std::optional<ResetDelay> expected_delay(const AlignState& state, const std::vector<AlignCamera>& cameras,
                                         const AlignOptions& options, std::size_t camera);

/// The chance that a reset by hand which must move tau by `wanted` lands within `tolerance` of that, by the
/// shifts seen: a camera draws its phase evenly over the period (weighed as eight shifts), unless its shifts
/// show otherwise.
double chance_by_hand(std::span<const Seconds> shifts, Seconds wanted, Seconds tolerance, Seconds period);

/// The chance that a normal error of this standard deviation lies within the tolerance.
double chance_within(Seconds tolerance, Seconds sigma);

/// The instant within T / 2 of `near` at which a camera's frames are stamped, modulo T: the circular mean of
/// their stamps. Absent without stamps.
std::optional<TimePoint> common_stamp(std::span<const TimePoint> stamps, TimePoint near, Seconds period);

}  // namespace emberlock::smear
