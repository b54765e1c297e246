// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "smear_sync/align/align_choice.h"
#include "smear_sync/align/align_context.h"
#include "smear_sync/align/align_dial.h"
#include "smear_sync/align/align_forecast.h"
#include "smear_sync/align/align_hold.h"
#include "smear_sync/align/align_look.h"
#include "smear_sync/align/align_trim.h"
#include "smear_sync/align/reset_delay.h"
#include "smear_sync/align/stagger.h"

namespace emberlock::smear {
namespace {

std::vector<std::optional<FrameRateTrim>> trims_of(const std::vector<AlignCamera>& cameras) {
  std::vector<std::optional<FrameRateTrim>> trims;
  trims.reserve(cameras.size());
  for (const AlignCamera& camera : cameras) trims.push_back(camera.trim);
  return trims;
}

AlignScene scene_of(const AlignState& state, const std::vector<Drift>& drifts, const AlignContext& c) {
  AlignScene scene{
      c.options.policy, c.options.period, std::max(c.tolerance, c.reach), c.options.reference, {}, {}};
  const Seconds jitter = learnt_jitter(state, c.options);
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    scene.tau.push_back(drifts[i].tau);
    ResetLanding landing{c.cameras[i].method, std::nullopt, state.cameras[i].hand_shifts, c.cameras[i].model};
    if (const auto delay = expected_delay(state, c.cameras, c.options, i))
      landing.aim = Seconds(std::hypot(delay->sigma.value(), jitter.value()));
    scene.landings.push_back(landing);
  }
  return scene;
}

/// Timed resets: each at its moment where the delay is known; else untimed, to teach it. A model is taught by
/// one of its cameras, and the others wait.
void time_resets(const AlignState& state, AlignDecision& decision, const std::vector<Drift>& drifts,
                 const AlignContext& c, const AlignScene& scene) {
  const std::vector<Drift> courses = courses_of(state, decision, drifts, c);
  std::vector<std::string> teaching;
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const AlignCamera& who = c.cameras[i];
    if (!camera.reset || !scene.timed(i) || !c.round.cameras[i].stamp) continue;
    if (const auto delay = expected_delay(state, c.cameras, c.options, i)) {
      // t_start shall move by tau - tau_target, and the stamps move with it.
      const Seconds aim = state.held && c.reach == Seconds(0)
                              ? aim_of(courses[i], scene.landings[i].aim.value_or(c.tolerance), c)
                              : Seconds(0);
      camera.moment = *c.round.cameras[i].stamp + *camera.error - aim - delay->mean;
      camera.reason.timing = aim == Seconds(0) ? ResetTiming::on_target : ResetTiming::far_side;
    } else if (std::find(teaching.begin(), teaching.end(), who.model) == teaching.end()) {
      teaching.push_back(who.model);
      camera.reason.timing = ResetTiming::teaches;
    } else {
      camera.reset = false;
      camera.reason = {CameraCause::untaught};
    }
  }
}

/// Orders for the cameras out of tolerance, and why every camera gets what it gets.
void order_resets(AlignDecision& decision, const AlignContext& c, const AlignScene& scene, Seconds target) {
  const std::vector<bool> chosen = choose_resets(scene, target);
  for (std::size_t i = 0; i < scene.tau.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    camera.reset = chosen[i];
    if (c.options.policy == AlignPolicy::fixed_reference && i == scene.reference) {
      camera.reason = {CameraCause::reference};
    } else if (scene.within(i, target)) {
      camera.reason = {CameraCause::within};
    } else if (!scene.movable(i)) {
      camera.reason = {CameraCause::fixed};
    } else if (!chosen[i]) {
      camera.reason = {CameraCause::waits};
    } else if (scene.landings[i].method == ShutterReset::by_hand) {
      camera.reason = {CameraCause::by_hand};
    } else {
      camera.reason = {CameraCause::reset};
    }
  }
}

/// People reset one camera at a time: the one that they were asked for as long as it has to be, then the one
/// that is farthest out.
void ask_for_one(AlignState& state, AlignDecision& decision, const AlignContext& c) {
  if (c.options.reset_by == ResetBy::orders) return;
  std::optional<std::size_t> farthest;
  const std::optional<std::size_t> before = std::exchange(state.asked, std::nullopt);
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    if (!camera.reset || c.cameras[i].method != ShutterReset::by_hand) continue;
    if (before == i) state.asked = i;
    if (!farthest || abs(*camera.error) > abs(*decision.cameras[*farthest].error)) farthest = i;
  }
  if (!state.asked) state.asked = farthest;
  decision.reset_next = state.asked;
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    if (!camera.reset || c.cameras[i].method != ShutterReset::by_hand) continue;
    camera.reset = false;
    if (i == state.asked) continue;
    camera.reason = {.cause = CameraCause::in_turn, .after = state.asked};
  }
}

/// Whether the tolerance can be told from the noise, and is met within the limits. Asked once.
bool can_be_met(AlignState& state, AlignDecision& decision, const AlignContext& c, const AlignScene& scene,
                const std::vector<Drift>& drifts) {
  if (!c.options.limits || state.affordable) return true;
  const Prospect prospect{scene, drifts, trims_of(c.cameras), learnt_jitter(state, c.options)};
  decision.effort = foretell(prospect, c.options.policy, c.tolerance, c.options);
  Seconds noise;
  for (const Drift& drift : drifts) noise = std::max(noise, drift.tau_sigma);
  if (c.tolerance < kTellable * noise) {
    decision.verdict = AlignVerdict::refused;
    decision.reason = {.cause = AlignCause::untellable, .sigma = noise};
    return false;
  }
  if (decision.effort->within >= c.options.limits->probability) {
    state.affordable = true;
    return true;
  }
  decision.verdict = AlignVerdict::refused;
  decision.offers = find_offers(prospect, c.options);
  decision.reason = {AlignCause::too_costly};
  return false;
}

/// The camera that stands for the target.
std::size_t nearest(const AlignDecision& decision, const AlignOptions& options) {
  if (options.policy == AlignPolicy::fixed_reference) return options.reference;
  const auto closer = [](const CameraDecision& a, const CameraDecision& b) {
    return in_picoseconds(abs(*a.error)) < in_picoseconds(abs(*b.error));
  };
  const auto& cameras = decision.cameras;
  return static_cast<std::size_t>(std::min_element(cameras.begin(), cameras.end(), closer) - cameras.begin());
}

/// The target that is trimmed to or held, while no camera is out of reach of it; of timed resets, while most
/// are within tolerance: the others are brought back to it.
std::optional<Seconds> keep_target(AlignState& state, const AlignContext& c, const AlignScene& scene) {
  if (!state.target) return std::nullopt;
  const Seconds target = target_at(*state.target, c.round.at, c.options.period);
  std::size_t out = 0;
  for (std::size_t i = 0; i < scene.tau.size(); ++i) out += scene.within(i, target) ? 0 : 1;
  if (out <= (c.reach > Seconds(0) ? 0 : scene.tau.size() / 2)) return target;
  state.target.reset();
  return std::nullopt;
}

/// Cameras that are all reset for a moment are held about a target that goes as the middle of them does.
void hold_target(AlignState& state, const std::vector<Drift>& drifts, const AlignContext& c,
                 const AlignScene& scene, Seconds target) {
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    if (!scene.timed(i)) return;
  }
  const auto [slowest, fastest] = std::minmax_element(
      drifts.begin(), drifts.end(), [](const Drift& a, const Drift& b) { return a.rate < b.rate; });
  state.target = AlignTarget{c.round.at, target, 0.5 * (slowest->rate + fastest->rate)};
}

/// Blind cameras that are held are brought out by the next check.
void look_for_blind(AlignDecision& decision, const AlignContext& c) {
  const auto blind = [](const CameraView& view) { return view.phase.state == PhaseState::blind; };
  if (std::any_of(c.round.cameras.begin(), c.round.cameras.end(), blind))
    decision.strobe_phase = next_look(c);
}

/// All are within tolerance, and aren't trimmed: whether that is a lock, for how long, and what makes it one.
void settle(AlignState& state, AlignDecision& decision, const std::vector<Drift>& drifts,
            const AlignContext& c, const AlignScene& scene, Seconds target) {
  const std::vector<Drift> courses = courses_of(state, decision, drifts, c);
  const bool asks = c.options.shortest_take > Seconds(0);
  // What is held is known as well as it was when it was called aligned.
  if (std::vector<std::size_t> unknown = unknown_drifts(courses, c);
      asks && !state.held && !unknown.empty()) {
    decision.reason = {AlignCause::drift_unknown, std::move(unknown)};
    return;
  }
  if ((state.held || asks) && renew(state, decision, courses, c, scene)) {
    time_resets(state, decision, drifts, c, scene);
    return;
  }
  if (std::vector<std::size_t> leaving = leaving_at_once(courses, c); !leaving.empty()) {
    decision.reason = {AlignCause::leaving, std::move(leaving)};
    return;
  }
  decision.verdict = AlignVerdict::aligned;
  decision.reason = {AlignCause::within};
  decision.renewed = renewed_stay(courses, c, scene);
  hold_target(state, drifts, c, scene, target);
}

void decide(AlignState& state, AlignDecision& decision, const std::vector<Drift>& drifts,
            const AlignContext& c) {
  const int looks = std::exchange(state.looks, 0);
  const AlignScene scene = scene_of(state, drifts, c);
  const Seconds target = keep_target(state, c, scene).value_or(choose_target(scene));
  decision.target = target;
  decision.worst_pair = Seconds(0);
  decision.goal = c.reach > Seconds(0) ? AlignGoal::reach : AlignGoal::tolerance;
  std::vector<std::size_t> out;
  std::vector<std::size_t> stuck;
  for (std::size_t i = 0; i < drifts.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    camera.error = scene.error(i, target);
    camera.sigma = drifts[i].tau_sigma;
    camera.reason = {CameraCause::stands};
    for (std::size_t k = 0; k < i; ++k)
      decision.worst_pair = std::max(*decision.worst_pair, abs(scene.error(i, scene.tau[k])));
    if (scene.within(i, target)) continue;
    out.push_back(i);
    if (!scene.movable(i)) stuck.push_back(i);
  }
  decision.reference = nearest(decision, c.options);
  if (!can_be_met(state, decision, c, scene, drifts)) return;
  if (state.target && c.reach == Seconds(0)) hold_target(state, drifts, c, scene, target);
  order_resets(decision, c, scene, target);
  time_resets(state, decision, drifts, c, scene);

  if (!stuck.empty()) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = {AlignCause::stuck, std::move(stuck)};
  } else if (!out.empty()) {
    decision.reason = {AlignCause::out, std::move(out)};
  } else if (c.reach == Seconds(0)) {
    settle(state, decision, drifts, c, scene, target);
  } else if (trim_rates(state, decision, c.round, c.cameras, c.options)) {
    decision.verdict = AlignVerdict::aligned;
    decision.reason = {AlignCause::locked};
  } else {
    time_resets(state, decision, drifts, c, scene);
    decision.reason = {AlignCause::trimming};
    // Where a dot is missing trims go by what was foretold; that ages.
    for (std::size_t i = 0; i < c.cameras.size(); ++i) {
      const bool blind = c.round.cameras[i].phase.state == PhaseState::blind;
      if (blind && state.cameras[i].phase.aged(c.round.at, c.track) > kMemoryPart * c.tolerance)
        decision.strobe_phase = next_look(c);
    }
  }
  ask_for_one(state, decision, c);
  ask_for_moves(state, decision, c, looks);
  // Of staggered cameras some are blind at any delay: as long as drifts are measured they take turns.
  const bool measures = decision.reason.cause == AlignCause::drift_unknown && staggered(c.cameras);
  if (decision.verdict == AlignVerdict::aligned || measures) look_for_blind(decision, c);
  decision.reference = nearest(decision, c.options);
  foresee(state, decision, drifts, c);
}

/// A policy that trims needs cameras that can be: the first that can't.
std::optional<std::size_t> untrimmable(const AlignContext& c) {
  if (c.options.policy != AlignPolicy::trimmed) return std::nullopt;
  for (std::size_t i = 0; i < c.cameras.size(); ++i) {
    if (!c.cameras[i].trim) return i;
  }
  return std::nullopt;
}

/// The round as it would be if the flashes weren't delayed: nobody but who fills a round, and who is told its
/// target, knows of phases that hold the delay.
AlignRound without_delay(AlignRound round, Seconds period) {
  for (CameraView& camera : round.cameras) {
    if (camera.phase.state == PhaseState::known)
      camera.phase.tau = wrap_positive(camera.phase.tau - round.strobe_phase, period);
  }
  return round;
}

/// The round as it would be if every camera's own instant were the target: its read phase earlier by its
/// offset, tau later. Nobody else knows of offsets but who is told its own target.
AlignRound without_offsets(AlignRound round, const std::vector<AlignCamera>& cameras, Seconds period) {
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    Phase& phase = round.cameras[i].phase;
    if (phase.state == PhaseState::known && cameras[i].offset != Seconds(0))
      phase.tau = wrap_positive(phase.tau + cameras[i].offset, period);
  }
  return round;
}

/// One round of flashes whose delay is known.
AlignStep step_at(const AlignState& before, const AlignRound& delayed,
                  const std::vector<AlignCamera>& cameras, const AlignOptions& options) {
  const AlignRound round = without_delay(delayed, options.period);
  AlignState state = before;
  state.cameras.resize(cameras.size());
  ++state.rounds;
  ++state.rounds_out;
  const bool trims = options.policy == AlignPolicy::trimmed;
  const AlignContext c{round,
                       cameras,
                       options,
                       track_options(options),
                       options.tolerance.in_time(options.row_time),
                       trims ? trim_reach(trims_of(cameras), options) : Seconds(0)};
  AlignDecision decision;
  decision.jumped = remember(state, c);
  decision.round = state.rounds;
  decision.resets_so_far = state.resets;
  decision.cameras.resize(cameras.size());
  std::vector<Drift> drifts;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const bool doubted = state.cameras[i].doubt.has_value();
    decision.cameras[i].state = doubted ? PhaseState::unusable : round.cameras[i].phase.state;
    if (const auto drift = where(state.cameras[i], c)) drifts.push_back(*drift);
  }
  if (const auto camera = untrimmable(c)) {
    decision.verdict = AlignVerdict::refused;
    decision.reason = {AlignCause::untrimmable, {*camera}};
  } else if (drifts.size() < cameras.size()) {
    look_again(state, decision, c);
  } else {
    decide(state, decision, drifts, c);
  }
  if (decision.target) decision.target = wrap_positive(*decision.target + round.strobe_phase, options.period);
  follow_renewal(state, decision, c);
  state.held = decision.verdict == AlignVerdict::aligned || decision.renews;
  state.last_round = round.at;

  // People take their time, and may be gone.
  const bool waits =
      decision.reset_next || std::any_of(state.cameras.begin(), state.cameras.end(),
                                         [](const CameraTrack& camera) { return camera.away; });
  if (waits) state.rounds_out = std::max(0, state.rounds_out - 1);
  if (decision.verdict == AlignVerdict::aligned) state.rounds_out = 0;
  if (decision.verdict == AlignVerdict::go_on && state.rounds_out >= options.max_rounds) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason.rounds = state.rounds_out;
  }
  if (decision.verdict != AlignVerdict::go_on) {
    if (decision.verdict != AlignVerdict::aligned) decision.strobe_phase.reset();
    decision.reset_next.reset();
    for (CameraDecision& camera : decision.cameras) {
      camera.reset = false;
      camera.moment.reset();
    }
  }
  return {std::move(state), std::move(decision)};
}

}  // namespace

TrackOptions track_options(const AlignOptions& options) {
  return {.period = options.period, .rate_spread = options.rate_spread, .rate_wander = options.rate_wander};
}

AlignStep align_step(const AlignState& before, const AlignRound& filmed,
                     const std::vector<AlignCamera>& cameras, const AlignOptions& options) {
  const AlignRound round = without_offsets(filmed, cameras, options.period);
  if (!options.dial) return step_at(before, round, cameras, options);
  AlignState state = before;
  state.cameras.resize(cameras.size());
  const AlignRound weighed = weigh_flashes(state, round, options);
  DialAdvice advice = look_at_dial(state, weighed, options);
  if (!advice.ready) return wait_for_dial(std::move(state), weighed, std::move(advice));
  const AlignRound seen = without_walk(state, weighed, options);
  AlignStep step = step_at(state, seen, cameras, options);
  let_walk(step, seen, std::move(advice), options);
  return step;
}

}  // namespace emberlock::smear
