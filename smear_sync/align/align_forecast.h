// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "smear_sync/align/align.h"
#include "smear_sync/align/align_choice.h"

namespace emberlock::smear {

/// Where a rig stands and what is known of how its cameras move.
struct Prospect {
  AlignScene scene;
  std::vector<Drift> drifts;                        ///< by camera
  std::vector<std::optional<FrameRateTrim>> trims;  ///< by camera
  Seconds jitter;                                   ///< of one reset's delay about its camera's mean
};

/// What it takes to bring the prospect's cameras within `tolerance` by `policy`: the policy's choices played
/// through 200 times, with what resets do drawn by what is known of them. A pure function.
AlignEffort foretell(const Prospect& prospect, AlignPolicy policy, Seconds tolerance,
                     const AlignOptions& options);

/// Tolerances that can be met within the limits: this one by another policy, and wider ones by this policy.
std::vector<AlignOffer> find_offers(const Prospect& prospect, const AlignOptions& options);

/// How far from the target trimming may start: what the weakest trim covers in options.trim_time. Zero when a
/// camera can't be trimmed.
Seconds trim_reach(const std::vector<std::optional<FrameRateTrim>>& trims, const AlignOptions& options);

}  // namespace emberlock::smear
