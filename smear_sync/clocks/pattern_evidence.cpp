// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/pattern_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock::smear {
namespace {

constexpr double kEdge =
    0.005;  // flash periods: a flash this close to the exposure's border may light either picture
constexpr double kSlip = 0.02;  // probability that a repetition fails
constexpr double kRepeats = 5;  // log-likelihood ratio above which a clip counts as repeating itself

/// The flashes that certainly light a frame's picture, and whether another one may.
struct LitBy {
  std::int64_t first = 0, last = -1;
  bool doubtful = false;
};

LitBy lit_by(double start, double step) {
  LitBy by;
  by.first = static_cast<std::int64_t>(std::ceil(start - step + kEdge));
  by.last = static_cast<std::int64_t>(std::floor(start - kEdge));
  for (const double border : {start - step, start})
    by.doubtful = by.doubtful || std::abs(border - std::round(border)) < kEdge;
  return by;
}

/// Whether the frame is beside a change.
bool at_change(const std::vector<PatternFrame>& frames, std::size_t i) {
  const auto differs = [&](std::size_t other) {
    return frames[other].seen != FlashSeen::unknown && frames[other].seen != frames[i].seen;
  };
  return (i > 0 && differs(i - 1)) || (i + 1 < frames.size() && differs(i + 1));
}

/// How much better a clip is predicted by what it showed `lag` flashes before than by its previous flash: the
/// log-likelihood ratio of the best interval.
double repetition(const PatternEvidence& e, std::size_t lag) {
  const auto known = [&](std::size_t i) { return e.lit[i] != e.unlit[i]; };
  const auto is_lit = [&](std::size_t i) { return e.lit[i] > e.unlit[i]; };
  std::array<std::array<double, 2>, 2> counts{
      {{1, 0.1}, {1, 0.1}}};  // by the previous event: stayed, changed
  for (std::size_t i = 1; i < e.lit.size(); ++i) {
    if (known(i - 1) && known(i)) counts[is_lit(i - 1) ? 1 : 0][is_lit(i - 1) != is_lit(i) ? 1 : 0] += 1;
  }
  double sum = 0;
  double most = 0;
  for (std::size_t i = lag; i < e.lit.size(); ++i) {
    if (!known(i) || !known(i - 1) || !known(i - lag)) continue;
    const auto& of = counts[is_lit(i - 1) ? 1 : 0];
    const double plain = std::log(of[is_lit(i - 1) != is_lit(i) ? 1 : 0] / (of[0] + of[1]));
    sum = std::max(0.0, sum + std::log(is_lit(i) == is_lit(i - lag) ? 1 - kSlip : kSlip) - plain);
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace

PatternEvidence evidence_of(const PatternClip& clip, const SharedPatternOptions& o) {
  PatternEvidence evidence;
  const auto put = [&](std::int64_t flash, bool lit, double misread) {
    if (evidence.lit.empty()) evidence.first = flash;
    if (flash < evidence.first) return;
    const auto at = static_cast<std::size_t>(flash - evidence.first);
    if (at >= evidence.lit.size()) {
      evidence.lit.resize(at + 1, 0);
      evidence.unlit.resize(at + 1, 0);
    }
    evidence.lit[at] += std::log(lit ? 1 - misread : misread);
    evidence.unlit[at] += std::log(lit ? misread : 1 - misread);
  };
  for (std::size_t i = 0; i < clip.frames.size(); ++i) {
    const PatternFrame& frame = clip.frames[i];
    if (frame.seen == FlashSeen::unknown) continue;
    const LitBy by = lit_by(frame.start, o.flashes_per_frame);
    const bool lit = frame.seen == FlashSeen::yes;
    if (lit && (by.doubtful || by.last != by.first))
      continue;  // lit by one of several flashes, unknown which
    const double misread = at_change(clip.frames, i) ? o.misread_at_change : o.misread;
    for (std::int64_t flash = by.first; flash <= by.last; ++flash) put(flash, lit, misread);
  }
  return evidence;
}

PatternEvidence together(const PatternEvidence& a, const PatternEvidence& b, std::int64_t shift) {
  if (a.lit.empty() || b.lit.empty()) {
    PatternEvidence one = a.lit.empty() ? b : a;
    if (a.lit.empty()) one.first += shift;
    return one;
  }
  PatternEvidence both;
  both.first = std::min(a.first, b.first + shift);
  const std::int64_t end = std::max(a.end(), b.end() + shift);
  for (std::int64_t flash = both.first; flash < end; ++flash) {
    both.lit.push_back(a.lit_at(flash) + b.lit_at(flash - shift));
    both.unlit.push_back(a.unlit_at(flash) + b.unlit_at(flash - shift));
  }
  return both;
}

PatternShift count_agreement(const PatternEvidence& a, const PatternEvidence& b, std::int64_t shift) {
  PatternShift counts;
  counts.flashes = shift;
  const std::int64_t end = std::min(a.end(), b.end() + shift);
  for (std::int64_t flash = std::max(a.first, b.first + shift); flash < end; ++flash) {
    const double of_a = a.lit_at(flash) - a.unlit_at(flash);
    const double of_b = b.lit_at(flash - shift) - b.unlit_at(flash - shift);
    if (of_a == 0 || of_b == 0) continue;
    ++counts.common;
    counts.disagree += (of_a > 0) != (of_b > 0) ? 1 : 0;
  }
  return counts;
}

bool shows_change(const PatternEvidence& e) {
  bool lit = false;
  bool unlit = false;
  for (std::size_t i = 0; i < e.lit.size(); ++i) {
    lit = lit || e.lit[i] > e.unlit[i];
    unlit = unlit || e.lit[i] < e.unlit[i];
  }
  return lit && unlit;
}

std::vector<std::size_t> lags_of_repetition(const PatternEvidence& a, const PatternEvidence& b,
                                            const SharedPatternOptions& o) {
  std::vector<std::size_t> lags;
  for (std::size_t lag = 2; lag <= static_cast<std::size_t>(o.longest_period); ++lag) {
    if (std::max(repetition(a, lag), repetition(b, lag)) >= kRepeats) lags.push_back(lag);
  }
  return lags;
}

}  // namespace emberlock::smear
