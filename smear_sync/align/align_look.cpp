// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_look.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "smear_sync/align/move_together.h"
#include "smear_sync/align/reset_delay.h"
#include "smear_sync/align/unordered_reset.h"

namespace emberlock::smear {
namespace {

/// The strobe's delay goes round this part of the period: it must stay below the strobe's own, which may be
/// shorter than T.
constexpr double kLookRange = 0.95;
/// Successive delays step by this part of the period: however the blind phases lie, no two looks are alike.
constexpr double kLookStep = 0.381966011250105 * kLookRange;  // 1 - 1 / golden ratio

/// Shifts by hand that are remembered of a camera.
constexpr std::size_t kShifts = 16;

/// Of a camera that shows this while another's dot did move.
std::optional<Doubt> doubt_of(DotMotion motion, const DotMove& move) {
  switch (motion) {
    case DotMotion::untold:
    case DotMotion::with_all:
      break;
    case DotMotion::none:
      return Doubt{DoubtCause::stood, move.strobe, move.seen};
    case DotMotion::against:
      return Doubt{DoubtCause::against, move.strobe, move.seen};
    case DotMotion::otherwise:
      return Doubt{DoubtCause::otherwise, move.strobe, move.seen};
  }
  return std::nullopt;
}

/// Adds the cameras whose dots haven't been seen to move.
void note_unmoved(AlignReason& reason, const AlignState& state) {
  for (std::size_t i = 0; i < state.cameras.size(); ++i) {
    const CameraTrack& track = state.cameras[i];
    if (track.moved) continue;
    (track.rough ? reason.rough : reason.unmoved).push_back(i);
    reason.sigma = std::max(reason.sigma, track.rough.value_or(Seconds(0)));
  }
}

/// Compares what the round shows with what was seen before the strobe was moved: notes in `state` which
/// cameras' dots move with the strobe, and why those that move otherwise aren't taken for dots. Comes before
/// the round's phases are taken over.
void watch_moves(AlignState& state, const AlignContext& c) {
  const AlignRound& round = c.round;
  std::vector<std::optional<DotMove>> moves(state.cameras.size());
  for (std::size_t i = 0; i < moves.size(); ++i) {
    CameraTrack& track = state.cameras[i];
    const Phase& phase = round.cameras[i].phase;
    if (phase.state != PhaseState::known) continue;
    if (track.sighted && !round.moves_told) continue;
    if (track.sighted && track.phase.phase_known()) {
      const Drift drift = track.phase.at(round.at, c.track);
      const Seconds strobe = round.strobe_phase - track.sighted->strobe_phase;
      const Seconds before = track.sighted->tau;
      moves[i] = DotMove{strobe, wrap_symmetric(drift.tau + strobe - before, c.options.period),
                         wrap_symmetric(phase.tau + strobe - before, c.options.period),
                         Seconds(std::hypot(drift.tau_sigma.value(), phase.sigma.value()))};
    }
    track.sighted = Sighting{phase.tau, round.strobe_phase};
  }
  const std::vector<DotMotion> motions = move_together(moves, c.options.period);
  const auto stands = std::count(motions.begin(), motions.end(), DotMotion::none);
  const bool all_stand =
      stands > 1 && std::count(motions.begin(), motions.end(), DotMotion::untold) + stands ==
                        static_cast<std::ptrdiff_t>(motions.size());
  for (std::size_t i = 0; i < motions.size(); ++i) {
    CameraTrack& track = state.cameras[i];
    if (motions[i] == DotMotion::untold) {
      if (moves[i] && moves[i]->strobe != Seconds(0)) track.rough = moves[i]->sigma;
      continue;
    }
    track.moved = motions[i] == DotMotion::with_all;
    track.rough.reset();
    track.doubt = all_stand ? Doubt{DoubtCause::strobe_stood, moves[i]->strobe, moves[i]->seen}
                            : doubt_of(motions[i], *moves[i]);
  }
}

/// The shutter's phase was drawn anew, or may have been; `before` is kept where a shift is to be learnt.
void forget(CameraTrack& track, std::optional<Drift> before) {
  track.before_hand = before;
  track.phase.forget_phase();
  track.sighted.reset();
  track.moved = false;
  track.rough.reset();
  track.doubt.reset();
}

/// What people did: cameras that were switched off, and phases that jumped. Returns the latter.
std::vector<std::size_t> notice_people(AlignState& state, const AlignContext& c) {
  if (c.options.reset_by == ResetBy::orders) return {};
  const auto lose = [&](CameraTrack& track) {
    if (track.phase.phase_known()) forget(track, track.phase.at(c.round.at, c.track));
  };
  for (std::size_t i = 0; i < state.cameras.size(); ++i) {
    state.cameras[i].away = c.round.cameras[i].away;
    if (state.cameras[i].away) lose(state.cameras[i]);
  }
  std::vector<std::size_t> jumped = unordered_resets(state, c);
  for (const std::size_t i : jumped) lose(state.cameras[i]);
  return jumped;
}

Seconds moved_strobe(const AlignContext& c, Seconds by) {
  return wrap_positive(c.round.strobe_phase + by, kLookRange * c.options.period);
}

}  // namespace

std::vector<std::size_t> remember(AlignState& state, const AlignContext& c) {
  const AlignRound& round = c.round;
  for (const TrimDone& done : round.trims) {
    const auto& trim = c.cameras[done.camera].trim;
    state.cameras[done.camera].phase.order_trim(done.at + (trim ? trim->latency : Seconds(0)), done.trim,
                                                c.track);
  }
  for (const ResetDone& done : round.resets) {
    CameraTrack& track = state.cameras[done.camera];
    ++track.resets;
    ++state.resets;
    const bool shifts = !done.at && track.phase.phase_known();
    forget(track, shifts ? std::optional(track.phase.at(round.at, c.track)) : std::nullopt);
    const auto& stamp = round.cameras[done.camera].stamp;
    if (!done.at || !stamp) continue;
    learn_delay(state, c.cameras, c.options, done.camera, wrap_positive(*stamp - *done.at, c.options.period));
  }
  std::vector<std::size_t> jumped = notice_people(state, c);
  watch_moves(state, c);
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    const Phase& phase = round.cameras[i].phase;
    if (phase.state != PhaseState::known) continue;
    CameraTrack& track = state.cameras[i];
    track.phase.observe(round.at, phase, round.period_offset, c.track);
    if (!track.before_hand) continue;
    const Drift& before = *track.before_hand;
    const Seconds moved = (round.at - before.at) * (before.rate.value() * 1e-6);
    const Seconds shift = phase.tau - before.tau - moved;
    track.before_hand.reset();
    if (c.options.reset_by == ResetBy::anybody) {
      const Seconds sigma(std::hypot(before.tau_sigma.value(), phase.sigma.value()));
      if (same_phase(shift, sigma, c)) continue;  // it was only out of sight
      ++track.resets;
      ++state.resets;
      if (std::find(jumped.begin(), jumped.end(), i) == jumped.end()) jumped.push_back(i);
    }
    track.hand_shifts.push_back(wrap_positive(shift, c.options.period));
    if (track.hand_shifts.size() > kShifts) track.hand_shifts.erase(track.hand_shifts.begin());
  }
  return jumped;
}

std::optional<Drift> where(const CameraTrack& track, const AlignContext& c) {
  if (track.doubt) return std::nullopt;
  if (!track.phase.phase_known() || track.phase.aged(c.round.at, c.track) > c.remembered())
    return std::nullopt;
  return track.phase.at(c.round.at, c.track);
}

Seconds next_look(const AlignContext& c) { return moved_strobe(c, kLookStep * c.options.period); }

void look_again(AlignState& state, AlignDecision& decision, const AlignContext& c) {
  ++state.looks;
  std::vector<std::size_t> missing;
  bool hidden = false;
  bool away = false;
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const std::optional<Doubt>& doubt = state.cameras[i].doubt;
    const CameraView& view = c.round.cameras[i];
    if (where(state.cameras[i], c)) {
      camera.reason = {CameraCause::waits_for_others};
      continue;
    }
    missing.push_back(i);
    if (view.away) {
      away = true;
      camera.reason = {CameraCause::away};
    } else if (doubt) {
      hidden = true;
      camera.reason = {.cause = CameraCause::doubted, .doubt = doubt};
    } else if (view.phase.state == PhaseState::blind) {
      hidden = true;
      camera.reason = {CameraCause::blind};
    } else {
      camera.reason = {view.unheard ? CameraCause::unheard : CameraCause::unreadable};
    }
  }
  if (away) {
    state.looks = 0;  // looks find nobody who isn't there
  } else if (state.looks > c.options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = {.cause = AlignCause::unseen, .cameras = std::move(missing), .looks = state.looks};
    return;
  }
  if (hidden) decision.strobe_phase = next_look(c);
  decision.reason = {away ? AlignCause::waits_for_away : AlignCause::looks_again, std::move(missing)};
}

void ask_for_moves(AlignState& state, AlignDecision& decision, const AlignContext& c, int looks) {
  const bool resets = std::any_of(decision.cameras.begin(), decision.cameras.end(),
                                  [](const CameraDecision& camera) { return camera.reset; });
  const bool open = decision.verdict == AlignVerdict::go_on || decision.verdict == AlignVerdict::aligned;
  if (c.options.strobe_step == Seconds(0) || resets || !open) return;
  AlignReason reason = decision.reason;
  note_unmoved(reason, state);
  if (reason.unmoved.empty() && reason.rough.empty()) return;
  if (!decision.strobe_phase) decision.strobe_phase = moved_strobe(c, c.options.strobe_step);
  if (decision.verdict == AlignVerdict::go_on) return;
  state.looks = looks + 1;
  decision.reason = std::move(reason);
  if (state.looks > c.options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason.cause = AlignCause::unmoved;
    decision.reason.looks = state.looks;
    return;
  }
  decision.verdict = AlignVerdict::go_on;
}

}  // namespace emberlock::smear
