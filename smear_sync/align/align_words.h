// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "smear_sync/align/align.h"

// The sentences of the alignment's decisions, and what its steps share.
namespace emberlock::smear {

/// "reads 34.2 rows (1.847 ms) before the target"
std::string standing(Seconds error, SecondsPerRow row_time);

/// "1 camera", "3 cameras"
std::string plural(std::size_t count, const std::string& one);

/// "14 resets (95 %: 21) and 40 s (95 %: 1.2 min)"
std::string words(const AlignEffort& effort);
/// "12 s", "3.4 min", "2.1 h"
std::string words(Seconds time);

/// What is said of a tolerance that can't be met for what it takes, and of what could be.
std::string refusal(const AlignEffort& effort, const std::vector<AlignOffer>& offers,
                    const AlignOptions& options);

TrackOptions track_options(const AlignOptions& options);

}  // namespace emberlock::smear
