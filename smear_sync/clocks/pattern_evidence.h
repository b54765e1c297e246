// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smear_sync/clocks/shared_pattern.h"

namespace emberlock::smear {

/// What is known of a row of flashes: log-likelihoods of what was seen, were each lit, and were it not.
struct PatternEvidence {
  std::int64_t first = 0;
  std::vector<double> lit{}, unlit{};
  [[nodiscard]] std::int64_t end() const { return first + static_cast<std::int64_t>(lit.size()); }
  [[nodiscard]] bool holds(std::int64_t flash) const { return flash >= first && flash < end(); }
  [[nodiscard]] double lit_at(std::int64_t flash) const {
    return holds(flash) ? lit[static_cast<std::size_t>(flash - first)] : 0;
  }
  [[nodiscard]] double unlit_at(std::int64_t flash) const {
    return holds(flash) ? unlit[static_cast<std::size_t>(flash - first)] : 0;
  }
};

/// What a clip's frames say of its flashes. A lit frame that may have been lit by either of two says nothing.
PatternEvidence evidence_of(const PatternClip& clip, const SharedPatternOptions& options);

/// Both, the second's flashes renumbered.
PatternEvidence together(const PatternEvidence& a, const PatternEvidence& b, std::int64_t shift);

/// On how many flashes both tell of they agree, under a shift of the second; its probability is left out.
PatternShift count_agreement(const PatternEvidence& a, const PatternEvidence& b, std::int64_t shift);

/// Whether some flashes are lit and some aren't: else all places are as good.
bool shows_change(const PatternEvidence& e);

/// The lags, in flashes, at which one of the clips is seen to repeat itself, in order. Only these are allowed
/// for: that one clip repeats what only another showed is no better explanation than that both show the same.
std::vector<std::size_t> lags_of_repetition(const PatternEvidence& a, const PatternEvidence& b,
                                            const SharedPatternOptions& options);

}  // namespace emberlock::smear
