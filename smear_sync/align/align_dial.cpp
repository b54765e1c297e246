// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_dial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace emberlock::smear {
namespace {

constexpr double kPartOfTolerance = 0.1;
constexpr double kFollowedAtMost = 1.0 / 200;
constexpr double kStepsFollowed = 2;

/// A dial's rate wanders by so much in a minute, as a random walk.
constexpr PartsPerMillion kDialWander{30};
/// It was turned when its rate differs from what it was by so many standard errors, and by more than this.
constexpr double kTurnedSigmas = 8;
constexpr PartsPerMillion kTurnedLeast{30};
/// Few cameras aren't believed that stand further from the walk than this, in standard errors.
constexpr double kLikelyShift = 6;
/// Two cameras tell the same of the walk when they differ by less, in standard errors.
constexpr double kSameShift = 5;

/// Flashes stand nearly still when they walk less than a tenth of the period, by which a dot comes into
/// sight, in four seconds;
constexpr double kIntoSight = 0.1 / 4;  // of the period in a second
/// or less than a quarter of the strobe's step, by which a dot is seen to follow, in ten.
constexpr double kToFollow = 0.25 / 10;  // of the step in a second
/// A look is counted when the flashes have walked by this part of the period.
constexpr double kLookWalk = 0.38;
/// The dial is turned off the frames' rate by this part of what can be followed.
constexpr double kDetuned = 0.5;
constexpr double kNearlyDetuned = 0.6;

Hertz frame_rate_of(const AlignOptions& options) { return rate(options.period); }

Hertz wanted_of(const AlignState& state, const AlignOptions& options) {
  return options.dial->nearest(state.dial.wanted.value_or(frame_rate_of(options)));
}

/// A rate at which flashes walk fast enough, and can be followed.
Hertz detuned(const AlignOptions& options) {
  const StrobeDial& dial = *options.dial;
  const Hertz off = kDetuned * followed_at_most(options) * frame_rate_of(options);
  return dial.nearest(frame_rate_of(options) + std::max(off, dial.step));
}

/// The one that is nearest to all the others: a median that knows no beginning of the circle. The smaller of
/// two.
Seconds circular_middle(const std::vector<Seconds>& values, Seconds period) {
  Seconds best;
  double least = std::numeric_limits<double>::infinity();
  for (const Seconds candidate : values) {
    double sum = 0;
    for (const Seconds v : values) sum += abs(wrap_symmetric(v - candidate, period)).value();
    const bool closer = abs(candidate) < abs(best);
    if (sum < least - 1e-15 || (sum < least + 1e-15 && closer)) best = candidate;
    least = std::min(least, sum);
  }
  return best;
}

bool is_reset(const AlignRound& round, std::size_t camera) {
  return std::any_of(round.resets.begin(), round.resets.end(),
                     [&](const ResetDone& done) { return done.camera == camera; });
}

/// By what a camera that was seen before stands elsewhere than the walk, foretold, has it.
struct Voice {
  std::size_t camera = 0;
  Seconds shift;
  Seconds sigma;
};

/// What the cameras tell of how far the flashes have walked.
struct Hearing {
  std::vector<Voice> voices;
  std::optional<Seconds> shift;  ///< of most of them; of one where it is alone
  bool sure = false;             ///< several agree, so that each may be judged by the others
  bool split = false;            ///< several speak, and most of them don't agree
};

/// The largest group of voices that agree, if that is most of them and more than one.
std::optional<Seconds> told_by_most(const std::vector<Voice>& voices, Seconds period) {
  std::vector<Seconds> best;
  for (const Voice& candidate : voices) {
    std::vector<Seconds> alike;
    for (const Voice& voice : voices) {
      const Seconds apart = abs(wrap_symmetric(voice.shift - candidate.shift, period));
      const double sigma = std::hypot(voice.sigma.value(), candidate.sigma.value());
      if (apart.value() <= kSameShift * sigma) alike.push_back(voice.shift);
    }
    if (alike.size() > best.size()) best = std::move(alike);
  }
  if (best.size() < 2 || 2 * best.size() <= voices.size()) return std::nullopt;
  return circular_middle(best, period);
}

Seconds nearest_to_walk(const std::vector<Voice>& voices) {
  return std::min_element(voices.begin(), voices.end(),
                          [](const Voice& a, const Voice& b) { return abs(a.shift) < abs(b.shift); })
      ->shift;
}

Hearing hear(const AlignState& state, const AlignRound& round, Seconds walk, Seconds likely,
             const AlignOptions& options) {
  std::vector<Voice> all;
  Hearing heard;
  for (std::size_t i = 0; i < state.cameras.size(); ++i) {
    const CameraTrack& track = state.cameras[i];
    const Phase& phase = round.cameras[i].phase;
    if (phase.state != PhaseState::known || !track.phase.phase_known() || is_reset(round, i)) continue;
    const Drift drift = track.phase.at(round.at, track_options(options));
    all.push_back({i, wrap_symmetric(phase.tau - drift.tau - walk, options.period),
                   Seconds(std::hypot(drift.tau_sigma.value(), phase.sigma.value()))});
    if (!track.doubt || track.disputed()) heard.voices.push_back(all.back());
  }
  // Two that contradicted each other agree by chance whenever they have walked apart by a whole period.
  const bool chance = heard.voices.size() == 2 &&
                      std::all_of(heard.voices.begin(), heard.voices.end(),
                                  [&](const Voice& v) { return state.cameras[v.camera].disputed(); });
  if (!chance) heard.shift = told_by_most(heard.voices, options.period);
  if (!heard.shift && heard.voices.size() != 1) {
    // Who was doubted on a disputed word may turn out to be right.
    if (all.size() > heard.voices.size()) heard.shift = told_by_most(all, options.period);
    if (heard.shift) heard.voices = std::move(all);
  }
  heard.sure = heard.shift.has_value() || state.cameras.size() == 1;
  if (!heard.shift && heard.voices.size() == 1) heard.shift = heard.voices.front().shift;
  if (!heard.shift && !heard.voices.empty()) {
    // Somebody may have pressed a button: that is seen next, if the others are followed.
    heard.split = options.reset_by == ResetBy::orders;
    if (!heard.split) heard.shift = nearest_to_walk(heard.voices);
  }
  // A few that stand far from where a walk that goes on has them may be a reflection, or read the other way.
  const bool most = 2 * heard.voices.size() > state.cameras.size();
  if (heard.shift && !most && abs(*heard.shift) > likely) {
    heard.shift.reset();
    heard.sure = false;
  }
  return heard;
}

/// Of cameras of which nobody can say which is wrong.
void dispute(AlignState& state, const std::vector<std::size_t>& cameras) {
  for (const std::size_t i : cameras) {
    CameraTrack& track = state.cameras[i];
    if (track.doubt && !track.disputed()) continue;
    track.moved = false;
    track.doubt = Doubt{DoubtCause::walked_apart};
  }
}

/// What a camera's own dots tell, against the period offset that most tell, both with their standard errors.
std::optional<DoubtCause> doubt_of_rate(PeriodOffset own, PeriodOffset all) {
  const double sigma = std::hypot(own.sigma.value(), all.sigma.value());
  const double against = std::abs((own.rate + all.rate).value());
  const double still = std::abs(own.rate.value());
  if (std::min(against, still) > kSameShift * sigma) return std::nullopt;
  return against < still ? DoubtCause::walked_against : DoubtCause::stood_in_walk;
}

/// Cameras whose dots alone, in this round's film, tell another walk than most do. Returns whether as many
/// tell the one as the other, and none of them is known to err.
bool doubt_by_rates(AlignState& state, const AlignRound& round, const AlignOptions& options) {
  const FlashRate& flashes = round.flashes;
  if (flashes.seen != FlashesSeen::rate) return false;
  const PeriodOffset all = expected_period_offset(flashes.rate, options.period, flashes.sigma);
  std::vector<std::size_t> agree;
  std::vector<std::pair<std::size_t, DoubtCause>> doubts;
  for (std::size_t i = 0; i < flashes.own.size(); ++i) {
    const auto& own = flashes.own[i];
    if (!own) continue;
    if (own->agrees) {
      agree.push_back(i);
      continue;
    }
    const auto doubt = doubt_of_rate(expected_period_offset(own->rate, options.period, own->sigma), all);
    if (doubt) doubts.emplace_back(i, *doubt);
  }
  if (agree.size() > doubts.size()) {
    for (const auto& [i, doubt] : doubts) {
      state.cameras[i].moved = false;
      state.cameras[i].doubt = Doubt{doubt};
    }
    return false;
  }
  if (doubts.empty()) return false;
  std::vector<std::size_t> both = agree;
  for (const auto& [i, doubt] : doubts) both.push_back(i);
  const auto trusted = [&](std::size_t i) { return !state.cameras[i].doubt || state.cameras[i].disputed(); };
  if (!std::all_of(both.begin(), both.end(), trusted)) return false;
  dispute(state, both);
  return true;
}

/// Whether the rate is told by cameras alone whose dots are in doubt.
bool told_in_doubt(const AlignState& state, const FlashRate& flashes) {
  bool agree = false;
  for (std::size_t i = 0; i < flashes.own.size(); ++i) {
    if (!flashes.own[i] || !flashes.own[i]->agrees) continue;
    if (!state.cameras[i].doubt || state.cameras[i].disputed()) return false;
    agree = true;
  }
  return agree;
}

/// No phase of the round is taken over, but `kept`'s.
void leave_out(AlignRound& round, std::optional<std::size_t> kept) {
  for (std::size_t i = 0; i < round.cameras.size(); ++i) {
    CameraView& view = round.cameras[i];
    if (view.phase.state != PhaseState::known || kept == i) continue;
    view.phase = {PhaseState::unusable, {}, {}, {}};
    view.unheard = true;
  }
}

Seconds best_sigma(const AlignRound& round, Seconds otherwise) {
  std::optional<Seconds> best;
  for (const CameraView& camera : round.cameras) {
    if (camera.phase.state != PhaseState::known) continue;
    best = best ? std::min(*best, camera.phase.sigma) : camera.phase.sigma;
  }
  return best.value_or(otherwise);
}

bool seen_before(const AlignState& state, const AlignRound& round) {
  for (std::size_t i = 0; i < state.cameras.size(); ++i) {
    if (state.cameras[i].phase.phase_known() && !is_reset(round, i)) return true;
  }
  return false;
}

TrackOptions walk_options(const AlignOptions& options) {
  return {.period = options.period, .rate_spread = PartsPerMillion(0), .rate_wander = kDialWander};
}

}  // namespace

double followed_at_most(const AlignOptions& options) {
  const double tolerance = options.tolerance.in_time(options.row_time) / options.period;
  const double steps = kStepsFollowed * (options.dial->step / frame_rate_of(options));
  return std::max(std::min(kFollowedAtMost, kPartOfTolerance * tolerance), steps);
}

DialAdvice look_at_dial(AlignState& state, const AlignRound& round, const AlignOptions& options) {
  const FlashRate& flashes = round.flashes;
  DialAdvice advice;
  // It was followed a moment ago: the flashes walk on through a place where nobody shows them.
  const bool in_step = state.dial.walk.phase_known();
  if (flashes.seen == FlashesSeen::hidden && !in_step) state.dial.wanted = detuned(options);
  advice.set = wanted_of(state, options);
  advice.others = flashes.others;
  advice.seen = flashes.seen;
  if (flashes.seen == FlashesSeen::rate) {
    advice.measured = flashes.rate;
    advice.sigma = flashes.sigma;
    const double off = std::abs(flashes.rate * options.period - 1);
    advice.ready = off <= followed_at_most(options);
  } else {
    advice.ready = flashes.seen == FlashesSeen::hidden && in_step;
  }
  if (flashes.seen == FlashesSeen::too_slow) advice.slower_than = flashes.rate;
  advice.act = !advice.ready && flashes.seen != FlashesSeen::unsteady;
  if (!advice.ready) {
    advice.cause = DialCause::set;
  } else {
    advice.cause = advice.measured ? DialCause::leave : DialCause::out_of_sight;
  }
  return advice;
}

AlignStep wait_for_dial(AlignState state, const AlignRound& round, DialAdvice advice) {
  DialState& dial = state.dial;
  dial.resets.insert(dial.resets.end(), round.resets.begin(), round.resets.end());
  dial.trims.insert(dial.trims.end(), round.trims.begin(), round.trims.end());
  AlignDecision decision;
  decision.round = ++state.rounds;
  decision.resets_so_far = state.resets;
  decision.cameras.resize(state.cameras.size());
  for (CameraDecision& camera : decision.cameras) camera.reason = {CameraCause::waits_for_dial};
  decision.reason = {AlignCause::dial};
  decision.dial = std::move(advice);
  state.held = false;
  return {std::move(state), std::move(decision)};
}

AlignRound weigh_flashes(AlignState& state, const AlignRound& round, const AlignOptions& options) {
  AlignRound weighed = round;
  const bool undecided = doubt_by_rates(state, round, options);
  const bool in_step = state.dial.walk.phase_known();
  if (told_in_doubt(state, round.flashes) || (undecided && in_step)) {
    weighed.flashes.seen = FlashesSeen::hidden;
    weighed.flashes.rate = Hertz(0);
  }
  if (undecided) leave_out(weighed, {});
  return weighed;
}

AlignRound without_walk(AlignState& state, const AlignRound& round, const AlignOptions& options) {
  DialState& dial = state.dial;
  AlignRound seen = round;
  seen.resets.insert(seen.resets.begin(), dial.resets.begin(), dial.resets.end());
  seen.trims.insert(seen.trims.begin(), dial.trims.begin(), dial.trims.end());
  dial.resets.clear();
  dial.trims.clear();

  const TrackOptions walk = walk_options(options);
  Drift now;
  now.at = round.at;
  bool goes_on = dial.walk.phase_known();
  if (goes_on) {
    now = dial.walk.at(round.at, walk);
    const double apart = std::abs((round.period_offset.rate - now.rate).value());
    const double sigma = std::hypot(round.period_offset.sigma.value(), now.rate_sigma.value());
    goes_on =
        apart <= kTurnedSigmas * sigma + kTurnedLeast.value() || round.flashes.seen != FlashesSeen::rate;
  }
  if (!goes_on) dial.walk = {};  // turned: how far it walked meanwhile the cameras tell
  const Seconds likely =
      goes_on ? kLikelyShift * (now.tau_sigma + best_sigma(seen, now.tau_sigma)) : options.period;
  const Hearing heard = hear(state, seen, now.tau, likely, options);
  const Seconds tau = wrap_positive(now.tau + heard.shift.value_or(Seconds(0)), options.period);
  // Begun again on nobody's word, it would tear apart the cameras seen before from those seen now.
  const bool lost = !goes_on && !heard.shift && seen_before(state, seen);
  if (heard.shift || !goes_on) {
    const Seconds sigma = best_sigma(seen, 0.01 * options.period);
    dial.walk.observe(round.at, {PhaseState::known, tau, sigma, {}}, round.period_offset, walk);
  }
  const double speed = std::abs(dial.walk.at(round.at, walk).rate.value()) * 1e-6;
  if (lost) dial.walk.forget_phase();
  seen.moves_told = heard.sure;
  if (heard.split) {
    std::vector<std::size_t> cameras;
    for (const Voice& voice : heard.voices) cameras.push_back(voice.camera);
    dispute(state, cameras);
  }
  if (heard.split || lost) {
    leave_out(seen, {});
  } else if (!goes_on && !heard.sure && heard.voices.size() == 1) {
    leave_out(seen, heard.voices.front().camera);  // nobody says yet whether it is right
  }
  if (dial.at) dial.walked += speed * (round.at - *dial.at);
  dial.at = round.at;
  // Looks are counted by how far the flashes came, not by rounds.
  if (dial.walked < kLookWalk * options.period) {
    state.looks = std::max(state.looks - 1, 0);
  } else {
    dial.walked = Seconds(0);
  }
  seen.strobe_phase = tau;
  seen.period_offset = {PartsPerMillion(0), PartsPerMillion(1)};
  return seen;
}

void let_walk(AlignStep& step, const AlignRound& seen, DialAdvice advice, const AlignOptions& options) {
  AlignDecision& decision = step.decision;
  const bool wants_elsewhere = std::exchange(decision.strobe_phase, std::nullopt).has_value();
  if (wants_elsewhere && decision.verdict == AlignVerdict::go_on) {
    std::vector<std::size_t> hidden;
    for (std::size_t i = 0; i < decision.cameras.size(); ++i) {
      if (decision.cameras[i].state != PhaseState::known) hidden.push_back(i);
    }
    const Seconds in_a_second =
        hidden.empty() ? kToFollow * options.strobe_step : kIntoSight * options.period;
    const Drift walk = step.state.dial.walk.at(seen.at, walk_options(options));
    // Nor is more asked for than the dial, turned as it would be told, gives.
    const double given = kNearlyDetuned * (detuned(options) / frame_rate_of(options) - 1);
    if (std::abs(walk.rate.value()) * 1e-6 < std::min(in_a_second.value(), given)) {
      step.state.dial.wanted = detuned(options);
      advice.from = advice.measured.value_or(advice.set);
      advice.set = wanted_of(step.state, options);
      advice.act = true;
      advice.cause = DialCause::turn_off_rate;
      advice.hidden = std::move(hidden);
      decision.reason = {AlignCause::dial};
      step.state.rounds_out = std::max(0, step.state.rounds_out - 1);
    }
  }
  decision.dial = std::move(advice);
}

}  // namespace emberlock::smear
