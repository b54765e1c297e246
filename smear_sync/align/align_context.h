// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <vector>

#include "smear_sync/align/align.h"

namespace emberlock::smear {

/// A phase seen earlier counts until it may have walked by this part of the tolerance (one standard error);
/// of the trims' reach, which is far more, while trims bring the cameras together.
constexpr double kMemoryPart = 0.25;
constexpr double kMemoryPartOfReach = 0.05;

/// A tolerance of fewer standard errors of a phase can't be told.
constexpr double kTellable = 2;

/// What is the same for all of a round's steps.
struct AlignContext {
  const AlignRound& round;  ///< its strobe_phase taken out of all taus
  const std::vector<AlignCamera>& cameras;
  const AlignOptions& options;
  TrackOptions track;
  Seconds tolerance;
  Seconds reach;  ///< of trims; zero where the policy doesn't trim

  [[nodiscard]] Seconds remembered() const {
    return std::max(kMemoryPart * tolerance, kMemoryPartOfReach * reach);
  }
};

}  // namespace emberlock::smear
