// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_look.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "smear_sync/align/align_words.h"
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

std::string when_moved(const DotMove& move) {
  return fmt::format("when the strobe's flashes were moved by {:.2f} ms", in_milliseconds(move.strobe));
}

/// Of a camera that shows this while another's dot did move.
std::string doubt_of(DotMotion motion, const DotMove& move) {
  const std::string moved = when_moved(move);
  switch (motion) {
    case DotMotion::untold:
    case DotMotion::with_all:
      break;
    case DotMotion::none:
      return "its dot stood still " + moved +
             ": look for a reflection of the lamp in the lamp's own columns, shade it, or turn the camera";
    case DotMotion::against:
      return "its dot moved the other way " + moved + ": set its read direction the other way round";
    case DotMotion::otherwise:
      return fmt::format("its dot moved by {:.2f} ms ", in_milliseconds(move.seen)) + moved +
             ": see whether its row time is right, its shutter was reset, or a reflection stands in its "
             "columns";
  }
  return {};
}

/// The cameras whose dots haven't been seen to move: those that nothing was seen of, and those seen too
/// roughly.
struct Unmoved {
  std::string unseen;
  std::string rough;
  Seconds sigma;  ///< of the roughest

  [[nodiscard]] std::string all() const {
    return unseen + (unseen.empty() || rough.empty() ? "" : ", ") + rough;
  }
};

Unmoved unmoved_of(const AlignState& state, const std::vector<AlignCamera>& cameras) {
  Unmoved unmoved;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const CameraTrack& track = state.cameras[i];
    if (track.moved) continue;
    std::string& list = track.rough ? unmoved.rough : unmoved.unseen;
    list += (list.empty() ? "" : ", ") + cameras[i].id;
    unmoved.sigma = std::max(unmoved.sigma, track.rough.value_or(Seconds(0)));
  }
  return unmoved;
}

/// Why a run ends whose cameras lie in tolerance as far as anybody can tell.
std::string why_untold(const Unmoved& unmoved, const AlignOptions& options, int looks) {
  std::string why;
  if (!unmoved.unseen.empty()) {
    why = "no dot of " + unmoved.unseen + " was seen at two places of the strobe in " +
          plural(static_cast<std::size_t>(looks), "look") +
          ": check that the lamp is in view and not over-exposed";
  }
  if (unmoved.rough.empty()) return why;
  if (!why.empty()) why += "; ";
  return why + fmt::format(
                   "the phase of {} is known to {:.2f} ms, too roughly to see it follow the "
                   "strobe by {:.2f} ms: ask for a finer tolerance, or give it more of the flash",
                   unmoved.rough, in_milliseconds(unmoved.sigma), in_milliseconds(options.strobe_step));
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
      const Seconds before = track.sighted->tau;
      moves[i] = DotMove{round.strobe_phase - track.sighted->strobe_phase,
                         wrap_symmetric(drift.tau + round.strobe_phase - before, c.options.period),
                         wrap_symmetric(phase.tau - before, c.options.period),
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
    track.disputed = false;
    track.doubt = all_stand ? "no camera's dot moved " + when_moved(*moves[i]) +
                                  ": see whether the strobe does as it is told"
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
  track.doubt.clear();
  track.disputed = false;
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
    Phase phase = round.cameras[i].phase;
    if (phase.state != PhaseState::known) continue;
    phase.tau = wrap_positive(phase.tau - round.strobe_phase, c.options.period);
    CameraTrack& track = state.cameras[i];
    track.phase.observe(round.at, phase, round.beat, c.track);
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
  if (!track.doubt.empty()) return std::nullopt;
  if (!track.phase.phase_known() || track.phase.aged(c.round.at, c.track) > c.remembered())
    return std::nullopt;
  return track.phase.at(c.round.at, c.track);
}

Seconds next_look(const AlignContext& c) { return moved_strobe(c, kLookStep * c.options.period); }

void look_again(AlignState& state, AlignDecision& decision, const AlignContext& c) {
  ++state.looks;
  std::string missing;
  std::string why;
  bool hidden = false;
  bool away = false;
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const std::string& doubt = state.cameras[i].doubt;
    const Phase& phase = c.round.cameras[i].phase;
    if (where(state.cameras[i], c)) {
      camera.reason = "its phase is known: waits for the cameras whose phase isn't";
      continue;
    }
    missing += (missing.empty() ? "" : ", ") + c.cameras[i].id;
    if (c.round.cameras[i].away) {
      away = true;
      camera.reason = "sends no frames: switch it on, or plug it in; it goes on by itself";
    } else if (!doubt.empty()) {
      hidden = true;
      camera.reason = doubt;
      if (why.empty()) why = doubt;
    } else if (phase.state == PhaseState::blind) {
      hidden = true;
      camera.reason = (c.options.dial ? "shows no phase: waits until the flashes have walked on ("
                                      : "shows no phase: the strobe's is moved to bring it out (") +
                      phase.reason + ")";
    } else {
      camera.reason = "can't be read: see to its view of the lamp and to the strobe (" + phase.reason + ")";
      if (why.empty()) why = phase.reason;
    }
  }
  if (away) {
    state.looks = 0;  // looks find nobody who isn't there
  } else if (state.looks > c.options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason =
        "no phase of " + missing + " after " + plural(static_cast<std::size_t>(state.looks), "look") +
        " at different phases of the strobe: " +
        (why.empty() ? "check that the lamp is in view, not over-exposed, and flashes once a frame" : why);
    return;
  }
  if (hidden) decision.strobe_phase = next_look(c);
  decision.reason = (away ? "waits for " : "looks again for ") + missing;
}

void ask_for_moves(AlignState& state, AlignDecision& decision, const AlignContext& c, int looks) {
  const bool resets = std::any_of(decision.cameras.begin(), decision.cameras.end(),
                                  [](const CameraDecision& camera) { return camera.reset; });
  const bool open = decision.verdict == AlignVerdict::go_on || decision.verdict == AlignVerdict::aligned;
  if (c.options.strobe_step == Seconds(0) || resets || !open) return;
  const Unmoved unmoved = unmoved_of(state, c.cameras);
  const std::string all = unmoved.all();
  if (all.empty()) return;
  if (!decision.strobe_phase) decision.strobe_phase = moved_strobe(c, c.options.strobe_step);
  if (decision.verdict == AlignVerdict::go_on) return;
  state.looks = looks + 1;
  if (state.looks > c.options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = why_untold(unmoved, c.options, state.looks);
    return;
  }
  decision.verdict = AlignVerdict::go_on;
  decision.reason += c.options.dial
                         ? "; the dot of " + all + " must be seen to follow the flashes as they walk"
                         : fmt::format("; the strobe is moved by {:.2f} ms, which the dot of {} must follow",
                                       in_milliseconds(c.options.strobe_step), all);
}

}  // namespace emberlock::smear
