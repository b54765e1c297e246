// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "smear_sync/clocks/shared_pattern.h"

namespace emberlock::smear {

/// Evidence for a sequence of flashes: log-likelihoods of the observation if the flash was lit, and if it
/// wasn't.
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

/// Evidence from a clip's frames. A lit frame that two flashes may have lit is no evidence.
PatternEvidence evidence_of(const PatternClip& clip, const SharedPatternOptions& options);

/// Combines both; the flashes of the second are renumbered by `shift`.
PatternEvidence together(const PatternEvidence& a, const PatternEvidence& b, std::int64_t shift);

/// Compares the flashes observed in both, with the second shifted. The result's probability isn't set.
PatternShift count_agreement(const PatternEvidence& a, const PatternEvidence& b, std::int64_t shift);

/// Whether some flashes are lit and some aren't. Otherwise no shift can be preferred.
bool shows_change(const PatternEvidence& e);

/// The lags, in flashes, at which one of the clips repeats its own pattern, ascending. Only these are
/// modelled: that one clip should repeat a pattern seen only in another is no better explanation than a
/// common pattern.
std::vector<std::size_t> lags_of_repetition(const PatternEvidence& a, const PatternEvidence& b,
                                            const SharedPatternOptions& options);

}  // namespace emberlock::smear
