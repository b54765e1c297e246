#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "smear_sync/align.h"

namespace emberlock {

/// What a reset has just taught, joined with what was expected: weighed by their variances, on the circle. An
/// observation that the expectation excludes (five standard deviations) replaces it: the expectation was
/// wrong.
ResetDelay learn_delay(const std::optional<ResetDelay>& expected, Seconds observed,
                       const AlignOptions& options);

/// The delay to expect of a camera's next reset: its own if a reset has taught it, else that of the cameras
/// of its model that have been taught, else what was known before; absent when nothing is known.
std::optional<ResetDelay> expected_delay(const AlignState& state, const std::vector<AlignCamera>& cameras,
                                         const AlignOptions& options, std::size_t camera);

/// The instant within T / 2 of `near` at which a camera's frames are stamped, modulo T: the circular mean of
/// their stamps. Absent without stamps.
std::optional<TimePoint> common_stamp(std::span<const TimePoint> stamps, TimePoint near, Seconds period);

}  // namespace emberlock
