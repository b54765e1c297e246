// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/shared_pattern.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/square.h"
#include "smear_sync/clocks/pattern_evidence.h"
#include "smear_sync/clocks/pattern_model.h"

namespace emberlock::smear {
namespace {

constexpr double kNegligible = 25;     // log-probabilities this far below the best are ignored
constexpr int kFewestCommon = 8;       // flashes
constexpr double kDisagreeing = 0.04;  // share of the common flashes; added to kDisagreeingAnyhow
constexpr int kDisagreeingAnyhow = 2;

/// The log-probability of all observations, or -infinity once it falls below a bound.
double log_probability(const PatternEvidence& e, PatternModel& model, double bound) {
  double sum = 0;
  for (std::size_t i = 0; i < e.lit.size(); ++i) {
    sum += model.next(std::exp(e.lit[i]), std::exp(e.unlit[i]));
    if (sum < bound) return -std::numeric_limits<double>::infinity();
  }
  return sum;
}

/// The shift according to the other source: mean and standard error.
struct Told {
  double shift, sigma;
};

/// A shift and its prior probability.
struct Candidate {
  std::int64_t shift;
  double prior;  ///< log
  double bound;  ///< log: upper limit of its probability, prior included
};

std::vector<Candidate> candidates(const PatternEvidence& a, const PatternEvidence& b,
                                  const std::optional<Told>& told, const SharedPatternOptions& o) {
  const auto best_of = [](const PatternEvidence& e) {
    double sum = 0;
    for (std::size_t i = 0; i < e.lit.size(); ++i) sum += std::max(e.lit[i], e.unlit[i]);
    return sum;
  };
  const double apart = best_of(a) + best_of(b);
  std::vector<Candidate> all;
  const std::int64_t first = a.first - b.end() + 1;
  const std::int64_t last = a.end() - b.first - 1;
  const auto count = static_cast<double>(last - first + 1);
  for (std::int64_t shift = first; shift <= last; ++shift) {
    double loss = 0;
    const std::int64_t end = std::min(a.end(), b.end() + shift);
    for (std::int64_t flash = std::max(a.first, b.first + shift); flash < end; ++flash) {
      const auto i = static_cast<std::size_t>(flash - a.first);
      const auto j = static_cast<std::size_t>(flash - shift - b.first);
      loss += std::max(a.lit[i] + b.lit[j], a.unlit[i] + b.unlit[j]) - std::max(a.lit[i], a.unlit[i]) -
              std::max(b.lit[j], b.unlit[j]);
    }
    double share = 1 / count;
    if (told) {
      const double z = (static_cast<double>(shift) - told->shift) / told->sigma;
      share = o.told_wrong * share +
              (1 - o.told_wrong) * std::exp(-0.5 * square(z)) / (told->sigma * std::sqrt(2 * M_PI));
    }
    const double prior = std::log((1 - o.unrelated) * share);
    all.push_back({shift, prior, prior + apart + loss});
  }
  std::sort(all.begin(), all.end(), [](const Candidate& x, const Candidate& y) { return x.bound > y.bound; });
  return all;
}

/// The shift of one group of clips relative to another.
struct Verdict {
  PatternShift best;
  double unrelated = 1;     ///< probability that they have no flash in common
  std::int64_t second = 0;  ///< the second best shift
  double second_probability = 0;
};

Verdict compare(const PatternEvidence& a, const PatternEvidence& b, const std::optional<Told>& told,
                const SharedPatternOptions& o) {
  Verdict verdict;
  if (!shows_change(a) || !shows_change(b)) return verdict;
  const std::vector<std::size_t> lags = lags_of_repetition(a, b, o);
  const double none = std::log(o.unrelated) + [&] {
    PatternModel model(lags);
    const double of_a = log_probability(a, model, -std::numeric_limits<double>::infinity());
    for (std::size_t i = 0; i <= (lags.empty() ? 0 : lags.back()); ++i) model.next(1, 1);
    return of_a + log_probability(b, model, -std::numeric_limits<double>::infinity());
  }();
  double best = none;
  std::vector<std::pair<double, std::int64_t>> found;
  for (const Candidate& c : candidates(a, b, told, o)) {
    if (c.bound < best - kNegligible) break;
    PatternModel model(lags);
    const double value =
        c.prior + log_probability(together(a, b, c.shift), model, best - kNegligible - c.prior);
    if (!std::isfinite(value)) continue;
    best = std::max(best, value);
    found.emplace_back(value, c.shift);
  }
  double sum = std::exp(none - best);
  for (const auto& [value, shift] : found) sum += std::exp(value - best);
  verdict.unrelated = std::exp(none - best) / sum;
  std::sort(found.begin(), found.end(), [](const auto& x, const auto& y) { return x.first > y.first; });
  if (found.empty()) return verdict;
  verdict.best = count_agreement(a, b, found[0].second);
  verdict.best.probability = std::exp(found[0].first - best) / sum;
  if (found.size() > 1) {
    verdict.second = found[1].second;
    verdict.second_probability = std::exp(found[1].first - best) / sum;
  }
  return verdict;
}

/// Clips with a common numbering of their flashes.
struct Group {
  std::vector<std::size_t> clips;
  std::vector<std::int64_t> shifts;   ///< flash j of the clip is flash j + shift of the group
  std::vector<double> probabilities;  ///< of the shift, relative to the first clip
  double joint = 1;                   ///< probability that all are right
  PatternEvidence evidence;
};

class Matcher {
 public:
  Matcher(std::span<const PatternClip> clips, std::size_t reference, const SharedPatternOptions& options)
      : clips_(clips), options_(options) {
    for (const PatternClip& clip : clips) evidence_.push_back(evidence_of(clip, options));
    groups_.push_back(alone(reference));
    for (std::size_t i = 0; i < clips.size(); ++i) {
      if (i != reference) groups_.push_back(alone(i));
    }
  }

  std::vector<PatternMatch> run() {
    while (grow_first() || join_others()) {
    }
    std::vector<PatternMatch> matches(clips_.size());
    const Group& main = groups_.front();
    for (std::size_t i = 0; i < main.clips.size(); ++i) matches[main.clips[i]] = stands(i);
    if (main.clips.size() > 1 && !matches[main.clips.front()].shift) {
      for (std::size_t i = 1; i < main.clips.size(); ++i)
        matches[main.clips[i]] = {std::nullopt, "the reference's own frames contradict the other clips'"};
    }
    for (std::size_t g = 1; g < groups_.size(); ++g) {
      const Verdict verdict = compare_groups(main, groups_[g]);
      for (const std::size_t clip : groups_[g].clips)
        matches[clip] = {std::nullopt, why_not(clip, main.clips.front(), verdict)};
    }
    return matches;
  }

 private:
  [[nodiscard]] Group alone(std::size_t clip) const { return {{clip}, {0}, {1.0}, 1, evidence_[clip]}; }

  /// The shift of two groups according to the other source, from the first clips of both for which it is
  /// known.
  [[nodiscard]] std::optional<Told> told(const Group& a, const Group& b) const {
    for (std::size_t i = 0; i < a.clips.size(); ++i) {
      for (std::size_t j = 0; j < b.clips.size(); ++j) {
        const PatternClip& of_a = clips_[a.clips[i]];
        const PatternClip& of_b = clips_[b.clips[j]];
        if (!of_a.told_origin || !of_b.told_origin) continue;
        return Told{*of_b.told_origin - *of_a.told_origin + static_cast<double>(a.shifts[i] - b.shifts[j]),
                    std::hypot(of_a.told_sigma, of_b.told_sigma)};
      }
    }
    return std::nullopt;
  }
  [[nodiscard]] Verdict compare_groups(const Group& a, const Group& b) const {
    return compare(a.evidence, b.evidence, told(a, b), options_);
  }
  [[nodiscard]] bool sure(const Verdict& v) const {
    return v.best.probability >= options_.confidence && v.best.common >= kFewestCommon && agrees(v.best);
  }

  static void join(Group& a, const Group& b, const PatternShift& shift) {
    for (std::size_t i = 0; i < b.clips.size(); ++i) {
      a.clips.push_back(b.clips[i]);
      a.shifts.push_back(b.shifts[i] + shift.flashes);
      a.probabilities.push_back(shift.probability * a.joint * b.joint);
    }
    a.joint *= b.joint * shift.probability;
    a.evidence = together(a.evidence, b.evidence, shift.flashes);
  }

  /// Merges the surest matching group into the first group; false if none matches.
  bool grow_first() {
    std::vector<std::pair<Verdict, std::size_t>> verdicts;
    for (std::size_t g = 1; g < groups_.size(); ++g) {
      const Verdict verdict = compare_groups(groups_.front(), groups_[g]);
      if (sure(verdict)) verdicts.emplace_back(verdict, g);
    }
    std::sort(verdicts.begin(), verdicts.end(), [](const auto& x, const auto& y) {
      return x.first.best.probability > y.first.best.probability;
    });
    for (const auto& [verdict, g] : verdicts) join(groups_.front(), groups_[g], verdict.best);
    std::sort(verdicts.begin(), verdicts.end(),
              [](const auto& x, const auto& y) { return x.second > y.second; });
    for (const auto& [verdict, g] : verdicts) groups_.erase(groups_.begin() + static_cast<std::ptrdiff_t>(g));
    return !verdicts.empty();
  }

  /// Merges two groups that don't yet match the first one; together they may.
  bool join_others() {
    for (std::size_t a = 1; a < groups_.size(); ++a) {
      for (std::size_t b = a + 1; b < groups_.size(); ++b) {
        const Verdict verdict = compare_groups(groups_[a], groups_[b]);
        if (!sure(verdict)) continue;
        join(groups_[a], groups_[b], verdict.best);
        groups_.erase(groups_.begin() + static_cast<std::ptrdiff_t>(b));
        return true;
      }
    }
    return false;
  }

  /// Tries a clip of the first group once more against all its other clips.
  [[nodiscard]] PatternMatch stands(std::size_t i) const {
    const Group& main = groups_.front();
    const std::size_t clip = main.clips[i];
    PatternShift shift;
    shift.flashes = main.shifts[i];
    shift.probability = main.probabilities[i];
    Group others;
    for (std::size_t k = 0; k < main.clips.size(); ++k) {
      if (k == i) continue;
      others.clips.push_back(main.clips[k]);
      others.shifts.push_back(main.shifts[k]);
      others.evidence = together(others.evidence, evidence_[main.clips[k]], main.shifts[k]);
    }
    if (others.clips.size() > 1) {
      const Verdict verdict = compare_groups(others, alone(clip));
      if (verdict.best.flashes != shift.flashes && verdict.best.probability > 0.5)
        return {std::nullopt, "its frames fit the other clips' together elsewhere than one by one"};
    }
    const PatternShift counts = count_agreement(others.evidence, evidence_[clip], shift.flashes);
    shift.common = counts.common;
    shift.disagree = counts.disagree;
    return {shift, fmt::format("its pattern of lit and unlit frames is the others': {} of {} common flashes "
                               "agree, and no other place fits as well (probability {})",
                               shift.common - shift.disagree, shift.common, in_words(shift.probability))};
  }

  static std::string in_words(double probability) {
    return probability > 0.99995 ? "over 0.9999" : fmt::format("{:.4f}", std::floor(probability * 1e4) / 1e4);
  }

  [[nodiscard]] std::string why_not(std::size_t clip, std::size_t reference, const Verdict& v) const {
    if (!shows_change(evidence_[clip]))
      return "every frame of it that tells is lit, or none is: it shows no pattern";
    if (!shows_change(evidence_[reference]))
      return "every frame of the reference that tells is lit, or none is: no pattern";
    if (v.unrelated > 0.5)
      return fmt::format(
          "its pattern of lit and unlit frames is nowhere surely the reference's: they have too little in "
          "common (probability that it is nothing: {:.2f})",
          v.unrelated);
    if (v.best.probability >= options_.confidence)
      return fmt::format(
          "at the best place {} of {} common flashes disagree: frames may have been lost, or it is another "
          "pattern",
          v.best.disagree, v.best.common);
    return fmt::format(
        "its pattern of lit and unlit frames fits the reference's in several places (by {:+d} flashes with "
        "probability {:.3f}, by {:+d} with {:.3f}): it repeats, or changes too seldom",
        v.best.flashes, v.best.probability, v.second, v.second_probability);
  }

  std::span<const PatternClip> clips_;
  SharedPatternOptions options_;
  std::vector<PatternEvidence> evidence_;
  std::vector<Group> groups_;  ///< the first contains the reference
};

Status check(std::span<const PatternClip> clips, std::size_t reference, const SharedPatternOptions& o) {
  const auto refuse = [](const char* what, const char* remedy) {
    return Error{ErrorKind::bad_input, what, "shared pattern", remedy};
  };
  if (reference >= clips.size()) return refuse("there is no such reference", "name one of the clips");
  if (!(std::abs(o.flashes_per_frame - 1) <= 0.05))
    return refuse("flashes_per_frame is not near 1", "flash about once a frame");
  if (!(o.misread > 0 && o.misread < 0.2) || !(o.misread_at_change > 0 && o.misread_at_change < 0.5))
    return refuse("misread is out of range", "give values in (0, 0.2) and (0, 0.5)");
  if (!(o.unrelated > 0 && o.unrelated < 1) || !(o.told_wrong > 0 && o.told_wrong < 1))
    return refuse("a prior probability is out of range", "give values in (0, 1)");
  if (!(o.confidence >= 0.5 && o.confidence < 1))
    return refuse("confidence is out of range", "give a value in [0.5, 1)");
  if (o.longest_period < 1) return refuse("longest_period is out of range", "give 1 or more");
  return {};
}

}  // namespace

Result<std::vector<PatternMatch>> match_patterns(std::span<const PatternClip> clips, std::size_t reference,
                                                 const SharedPatternOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check(clips, reference, options));
  return Matcher(clips, reference, options).run();
}

PatternShift agreement(const PatternClip& reference, const PatternClip& clip, std::int64_t shift,
                       const SharedPatternOptions& options) {
  return count_agreement(evidence_of(reference, options), evidence_of(clip, options), shift);
}

bool agrees(const PatternShift& shift) {
  return shift.disagree <= kDisagreeingAnyhow + kDisagreeing * shift.common;
}

}  // namespace emberlock::smear
