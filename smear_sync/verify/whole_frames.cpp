// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/whole_frames.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/one_to_one.h"
#include "smear_sync/clocks/shared_pattern.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<FrameWitness, std::string_view, 4> kWitnessNames{
    {{{FrameWitness::none, "none"},
      {FrameWitness::code, "code"},
      {FrameWitness::pattern, "pattern"},
      {FrameWitness::pattern_and_sound, "pattern and sound"}}}};

constexpr double kContradicts = 3;  // standard errors
constexpr double kMostDetuned = 0.05;
constexpr double kTie = 0.001;             // flash periods
constexpr double kWalkTheOtherWay = 0.04;  // the same if the sign of the line's slope is uncertain

/// The frame offset of two clips, if the code gives it.
std::optional<FrameOffset> offset_by_code(const ClipClock& reference, const ClipClock& clip,
                                          const FrameCode& code, std::int64_t frame) {
  const NumberedRun* from = reference.run_at(frame);
  if (from == nullptr) return std::nullopt;
  std::optional<FrameOffset> best;
  std::int64_t least = 0;
  for (const NumberedRun& run : clip.numbers.runs) {
    FrameOffset offset = frame_offset(*from, run, code, frame);
    const std::int64_t place = frame + offset.frames;
    const std::int64_t away = std::max({std::int64_t{0}, run.first - place, place - run.last});
    if (!best || away < least) {
      best = std::move(offset);
      least = away;
    }
  }
  return best;
}

/// A clip's frames on its own scale of flashes.
struct OwnScale {
  ClipTimes times;
  Seconds flash_period;
  /// Alternative offsets of all starts relative to that scale, in flash periods; 0 is one of them.
  std::vector<double> slacks{0.0};
  [[nodiscard]] double start(std::int64_t place) const { return times.read_start(place) / flash_period; }
};

OwnScale own_scale(const ClipClock& clock, const ClipOptions& options, std::int64_t at_place) {
  OwnScale own;
  own.flash_period = clock.flash_period;
  if (!clock.line) {
    own.times.period = clock.timing.frame_period;
    own.times.start = clock.flash_period * 0.5;
    own.times.drops = clock.numbers.drops;
    own.slacks = {0, -0.49, -0.25, 0.25, 0.49};
    return own;
  }
  own.times = strobe_times(clock);
  if (clock.tau_slack > Seconds(0)) own.slacks.push_back(-(clock.tau_slack / clock.flash_period));
  if (!clock.direction_known(options)) {
    // With the other read direction, the dot would be K rows minus its distance from the lamp. The flash that
    // lit the picture would be the same, but not the frame's start.
    const double start = own.start(at_place);
    const double tau = 1 - (start - std::floor(start));
    // If K is unknown too, a dot that isn't wrapped would be wrapped with the other direction.
    const bool shifts_known = clock.mode.shifts || options.shifts;
    const double most = std::floor((clock.timing.frame_period / options.row_time).value());
    for (const double shifts : {static_cast<double>(clock.timing.shifts),
                                shifts_known ? static_cast<double>(clock.timing.shifts) : most}) {
      const double other = Rows(shifts) * options.row_time / clock.flash_period - tau;
      own.slacks.push_back(tau - std::clamp(other, 0.0, 1.0));
    }
  }
  // Halfway between two frames both are equally close, so the uncertainty of the phase decides nothing.
  const double margin = clock.direction_known(options)
                            ? kContradicts * (clock.line->tau_sigma / clock.flash_period) + kTie
                            : kWalkTheOtherWay;
  for (std::size_t i = 0, count = own.slacks.size(); i < count; ++i) {
    own.slacks.push_back(own.slacks[i] - margin);
    own.slacks.push_back(own.slacks[i] + margin);
  }
  return own;
}

PatternClip pattern_of(const ClipClock& clock, const OwnScale& own) {
  PatternClip pattern;
  for (std::size_t i = 0; i < clock.seen.size(); ++i)
    pattern.frames.push_back({own.start(static_cast<std::int64_t>(i)), clock.seen[i]});
  return pattern;
}

/// The clip's frame that starts closest to the reference's, if both starts are off by these slacks.
std::int64_t nearest_count(const OwnScale& reference, double reference_slack, const OwnScale& clip,
                           double slack, std::int64_t flashes, std::int64_t frame) {
  const double instant = reference.start(frame) + reference_slack - static_cast<double>(flashes) - slack;
  return clip.times.nearest_count(clip.flash_period * instant);
}

/// Converts a shift of flashes to one of frames; nothing, with the reason, if an unknown phase leaves open
/// which frame is closest.
void frames_of_shift(const OwnScale& reference, const OwnScale& clip, std::int64_t frame,
                     WholeFrames& found) {
  const std::int64_t count = nearest_count(reference, 0, clip, 0, found.flashes, frame);
  for (const double a : reference.slacks) {
    for (const double b : clip.slacks) {
      if (nearest_count(reference, a, clip, b, found.flashes, frame) == count) continue;
      found.witness = FrameWitness::none;
      found.probability = 0;
      found.reason += "; but a phase isn't known, which leaves open one frame more or less";
      return;
    }
  }
  const std::int64_t place = clip.times.place_of(count).value_or(count);
  FrameOffset offset;
  offset.frames = place - frame;
  offset.lag = reference.start(frame) - clip.start(place) - static_cast<double>(found.flashes);
  offset.confidence = found.probability;
  offset.reason = found.reason;
  found.offset = std::move(offset);
}

class FrameMatcher {
 public:
  FrameMatcher(std::span<const ClipClock> clocks, std::size_t reference, std::int64_t frame,
               const ClipOptions& options, std::span<const std::optional<SoundOffset>> sounds)
      : clocks_(clocks), reference_(reference), frame_(frame), options_(options), sounds_(sounds) {
    for (const ClipClock& clock : clocks) {
      own_.push_back(own_scale(clock, options, frame));
      patterns_.push_back(pattern_of(clock, own_.back()));
    }
    with_.flashes_per_frame = clocks[reference].timing.frame_period / clocks[reference].flash_period;
  }

  Result<std::vector<WholeFrames>> run() {
    std::vector<WholeFrames> found(clocks_.size());
    bool all_by_code = true;
    for (std::size_t i = 0; i < clocks_.size(); ++i) {
      if (i != reference_) found[i] = by_code(i);
      all_by_code = all_by_code && (i == reference_ || found[i].offset);
    }
    if (!all_by_code) EMBERLOCK_RETURN_IF_ERROR(by_pattern(found));
    for (std::size_t i = 0; i < clocks_.size(); ++i) {
      if (i != reference_) hear(i, found[i]);
    }
    WholeFrames& itself = found[reference_];
    itself.offset = FrameOffset{.frames = 0, .lag = 0, .confidence = 1, .reason = {}};
    itself.probability = 1;
    itself.reason = "the reference's own frames";
    return found;
  }

 private:
  [[nodiscard]] const SoundOffset* sound(std::size_t i) const {
    return i < sounds_.size() && sounds_[i] ? &*sounds_[i] : nullptr;
  }

  /// By the code, unless other evidence contradicts: a pattern that happens to resemble a part of the code
  /// must not be numbered by it.
  [[nodiscard]] WholeFrames by_code(std::size_t i) const {
    WholeFrames found;
    found.offset = offset_by_code(clocks_[reference_], clocks_[i], options_.code, frame_);
    if (!found.offset) return found;
    const std::int64_t place = frame_ + found.offset->frames;
    found.flashes = std::llround(own_[reference_].start(frame_) - own_[i].start(place) - found.offset->lag);
    const bool phases = clocks_[reference_].line && clocks_[i].line;
    const PatternShift shared = agreement(patterns_[reference_], patterns_[i], found.flashes, with_);
    if (phases && !agrees(shared)) {
      found = {};
      found.reason = fmt::format(
          "what is lit looks like the strobe's code, but under it {} of {} common flashes disagree",
          shared.disagree, shared.common);
      return found;
    }
    found.witness = FrameWitness::code;
    found.probability = found.offset->confidence;
    found.reason = found.offset->reason;
    return found;
  }

  Status by_pattern(std::vector<WholeFrames>& found) const {
    if (std::abs(with_.flashes_per_frame - 1) > kMostDetuned) {
      for (WholeFrames& f : found) {
        if (!f.offset) f.reason = "the strobe doesn't flash about once a frame of the reference";
      }
      return {};
    }
    std::vector<PatternClip> told = patterns_;
    bool heard = false;
    for (std::size_t i = 0; i < told.size(); ++i) {
      const bool is_reference = i == reference_;
      if (!is_reference && sound(i) == nullptr) continue;
      const double later = is_reference ? 0 : sound(i)->later / own_[i].flash_period;
      told[i].told_origin = later - own_[i].start(0);
      told[i].told_sigma = is_reference ? 1e-3 : sound(i)->sigma / own_[i].flash_period;
      heard = heard || !is_reference;
    }
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<PatternMatch> silent,
                               match_patterns(patterns_, reference_, with_));
    std::vector<PatternMatch> with_sound = silent;
    const bool enough =
        std::all_of(silent.begin(), silent.end(), [](const PatternMatch& m) { return m.shift.has_value(); });
    if (heard && !enough) {
      EMBERLOCK_ASSIGN_OR_RETURN(with_sound, match_patterns(told, reference_, with_));
    }
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (i == reference_ || found[i].offset) continue;
      const bool alone = silent[i].shift.has_value();
      take(alone ? silent[i] : with_sound[i], alone ? FrameWitness::pattern : FrameWitness::pattern_and_sound,
           i, found[i]);
    }
    return {};
  }

  void take(const PatternMatch& match, FrameWitness witness, std::size_t i, WholeFrames& found) const {
    const std::string of_code = found.reason.empty() ? "" : found.reason + "; ";
    found.reason = of_code + match.reason;
    if (!match.shift) return;
    found.witness = witness;
    found.flashes = match.shift->flashes;
    found.probability = match.shift->probability;
    frames_of_shift(own_[reference_], own_[i], frame_, found);
  }

  /// Compares an offset with the sound: compatible or not; without an offset, the approximate one by the
  /// sound.
  void hear(std::size_t i, WholeFrames& found) const {
    const SoundOffset* heard = sound(i);
    if (heard == nullptr) return;
    const double in_ms = in_milliseconds(heard->sigma);
    if (!found.offset) {
      found.about = -(heard->later / own_[i].times.period);
      found.about_sigma = heard->sigma / own_[i].times.period;
      found.reason +=
          fmt::format("; the sound alone says {:+.1f} frames +- {:.1f}, which tells no single frame",
                      *found.about, found.about_sigma);
      return;
    }
    const Seconds later = own_[i].times.read_start(0) +
                          own_[i].flash_period * static_cast<double>(found.flashes) -
                          own_[reference_].times.read_start(0);
    const Seconds apart = later - heard->later;
    if (abs(apart) > heard->sigma * kContradicts) {
      const std::string witness(name(found.witness));
      found = {};
      found.reason = fmt::format(
          "{} and sound contradict one another by {:+.0f} ms, where the sound is known to {:.0f} ms ({}): no "
          "offset is claimed",
          witness, in_milliseconds(apart), in_ms, heard->reason);
      return;
    }
    found.reason += fmt::format("; the sound agrees to {:+.0f} ms +- {:.0f}", in_milliseconds(apart), in_ms);
    found.offset->reason = found.reason;
  }

  std::span<const ClipClock> clocks_;
  std::size_t reference_;
  std::int64_t frame_;
  const ClipOptions& options_;
  std::span<const std::optional<SoundOffset>> sounds_;
  SharedPatternOptions with_;
  std::vector<OwnScale> own_;
  std::vector<PatternClip> patterns_;
};

}  // namespace

std::string_view name(FrameWitness witness) { return kWitnessNames.second_of(witness).value_or("unknown"); }

Result<std::vector<WholeFrames>> match_frames(std::span<const ClipClock> clocks, std::size_t reference,
                                              std::int64_t frame, const ClipOptions& options,
                                              std::span<const std::optional<SoundOffset>> sounds) {
  return FrameMatcher(clocks, reference, frame, options, sounds).run();
}

}  // namespace emberlock::smear
