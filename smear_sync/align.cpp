#include "smear_sync/align.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "smear_sync/reset_delay.h"

namespace emberlock {
namespace {

/// The strobe's delay goes round this part of the period: it must stay below the strobe's own, which may be
/// shorter than T.
constexpr double kLookRange = 0.95;
/// Successive delays step by this part of the period: however the blind phases lie, no two looks are alike.
constexpr double kLookStep = 0.381966011250105 * kLookRange;  // 1 - 1 / golden ratio

/// A phase seen earlier counts until it may have walked by this part of the tolerance (one standard error).
constexpr double kMemoryPart = 0.25;

/// Cameras of which all phases are known, at one instant.
struct Scene {
  const std::vector<AlignCamera>& cameras;
  const AlignOptions& options;
  std::vector<Phase> phases;
  Seconds tolerance;

  [[nodiscard]] Seconds error(std::size_t camera, std::size_t reference) const {
    return phase_error(phases[camera], phases[reference], options.period);
  }
  [[nodiscard]] bool within(std::size_t camera, std::size_t reference) const {
    return abs(error(camera, reference)) <= tolerance;
  }
  [[nodiscard]] bool movable(std::size_t camera) const { return cameras[camera].method != ResetMethod::none; }
};

/// How well a camera would do as the reference; larger is better.
struct Merit {
  int stuck;    ///< minus the cameras that would have to move and can't
  int within;   ///< cameras within tolerance
  double near;  ///< minus the mean square error of those within tolerance: a tight group leaves room for more
  friend bool operator>(const Merit& a, const Merit& b) {
    return std::tie(a.stuck, a.within, a.near) > std::tie(b.stuck, b.within, b.near);
  }
};

Merit merit(const Scene& scene, std::size_t candidate) {
  Merit m{0, 0, 0};
  for (std::size_t i = 0; i < scene.phases.size(); ++i) {
    if (scene.within(i, candidate)) {
      ++m.within;
      const double e = scene.error(i, candidate).value();
      m.near -= e * e;
    } else if (!scene.movable(i)) {
      --m.stuck;
    }
  }
  m.near /= m.within;
  return m;
}

std::size_t choose_reference(const Scene& scene) {
  if (scene.options.policy == AlignPolicy::fixed_reference) return scene.options.reference;
  std::size_t best = 0;
  for (std::size_t i = 1; i < scene.phases.size(); ++i) {
    if (merit(scene, i) > merit(scene, best)) best = i;
  }
  return best;
}

Seconds worst_pair(const Scene& scene) {
  Seconds worst;
  for (std::size_t a = 0; a < scene.phases.size(); ++a) {
    for (std::size_t b = a + 1; b < scene.phases.size(); ++b) worst = std::max(worst, abs(scene.error(a, b)));
  }
  return worst;
}

std::string format(const char* pattern, auto... values) {
  char text[200];
  std::snprintf(text, sizeof text, pattern, values...);
  return text;
}

/// "reads 34.2 rows (1.847 ms) before the reference"
std::string standing(Seconds error, SecondsPerRow row_time) {
  return format("reads %.1f rows (%.3f ms) %s the reference", std::abs((error / row_time).value()),
                std::abs(in_milliseconds(error)), error.value() >= 0 ? "before" : "after");
}

std::string plural(std::size_t count, const std::string& one) {
  return std::to_string(count) + " " + one + (count == 1 ? "" : "s");
}

/// Takes over what the round showed: delays of resets, phases of the cameras seen, older phases moved on by
/// the beat.
void remember(AlignState& state, const AlignRound& round, const std::vector<AlignCamera>& cameras,
              const AlignOptions& options) {
  for (const ResetDone& done : round.resets) {
    CameraTrack& track = state.cameras[done.camera];
    track.phase.reset();
    ++track.resets;
    ++state.resets;
    const auto& stamp = round.cameras[done.camera].stamp;
    if (!done.at || !stamp) continue;
    const Seconds observed = wrap_positive(*stamp - *done.at, options.period);
    track.delay = learn_delay(expected_delay(state, cameras, options, done.camera), observed, options);
    ++track.taught;
  }
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Phase& now = round.cameras[i].phase;
    if (now.state != PhaseState::known) continue;
    CameraTrack& track = state.cameras[i];
    track.seen = round.at;
    track.phase = now;
    track.phase->tau = wrap_positive(now.tau - round.strobe_phase, options.period);
  }
}

/// A camera's phase at the round's instant, strobe_phase taken out: seen now, or seen earlier, moved on by
/// the beat and sure enough still.
std::optional<Phase> phase_now(const CameraTrack& track, const AlignRound& round,
                               const AlignOptions& options) {
  if (!track.phase) return std::nullopt;
  Phase phase = *track.phase;
  const Seconds elapsed = round.at - track.seen;
  const double aging = std::hypot(round.beat.sigma.value(), options.rate_spread.value()) * 1e-6;
  phase.tau = wrap_positive(phase.tau + elapsed * (round.beat.rate.value() * 1e-6), options.period);
  const Seconds walked = elapsed * aging;
  phase.sigma = Seconds(std::hypot(phase.sigma.value(), walked.value()));
  if (walked > kMemoryPart * options.tolerance.in_time(options.row_time)) return std::nullopt;
  return phase;
}

/// Some phases are missing: nobody is reset on half a view. Blind cameras are brought out by moving the
/// strobe.
void look_again(AlignState& state, AlignDecision& decision, const AlignRound& round,
                const std::vector<AlignCamera>& cameras, const AlignOptions& options) {
  ++state.looks;
  std::string missing;
  bool blind = false;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const Phase& phase = round.cameras[i].phase;
    if (phase_now(state.cameras[i], round, options)) {
      camera.reason = "its phase is known: waits for the cameras whose phase isn't";
      continue;
    }
    missing += (missing.empty() ? "" : ", ") + cameras[i].id;
    if (phase.state == PhaseState::blind) {
      blind = true;
      camera.reason = "shows no dot: the strobe's phase is moved to bring it out (" + phase.reason + ")";
    } else {
      camera.reason = "can't be read: see to its view of the lamp and to the strobe (" + phase.reason + ")";
    }
  }
  if (state.looks > options.max_looks) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = "no phase of " + missing + " after " +
                      plural(static_cast<std::size_t>(state.looks), "look") +
                      " at different phases of the strobe: check that the lamp is in view, not over-exposed, "
                      "and flashes once a frame";
    return;
  }
  if (blind)
    decision.strobe_phase =
        wrap_positive(round.strobe_phase + kLookStep * options.period, kLookRange * options.period);
  decision.reason = "looks again for " + missing;
}

/// Which of the cameras out of tolerance are reset this round.
std::vector<bool> choose_resets(const Scene& scene, std::size_t reference) {
  const AlignOptions& options = scene.options;
  std::vector<std::size_t> out;
  for (std::size_t i = 0; i < scene.phases.size(); ++i) {
    if (!scene.within(i, reference) && scene.movable(i)) out.push_back(i);
  }
  if (options.policy == AlignPolicy::densest) {
    // A phase drawn at random lands within tolerance with probability 2 tolerance / T, and each that lands
    // may move the reference to where a camera that waits is within tolerance already. So the farthest go
    // first, no more of them at once than land half a camera.
    const auto at_once = static_cast<std::size_t>(std::max(1.0, options.period / scene.tolerance / 4));
    std::stable_sort(out.begin(), out.end(), [&](std::size_t a, std::size_t b) {
      return abs(scene.error(a, reference)) > abs(scene.error(b, reference));
    });
    out.resize(std::min(out.size(), at_once));
  }
  std::vector<bool> chosen(scene.phases.size(), false);
  for (const std::size_t i : out) chosen[i] = true;
  return chosen;
}

/// Timed resets: each at its moment where the delay is known; else untimed, to teach it. A model whose
/// cameras share one delay is taught by one of them, and the others wait.
void time_resets(const AlignState& state, AlignDecision& decision, const AlignRound& round,
                 const Scene& scene) {
  const AlignOptions& options = scene.options;
  const bool models_share = options.delay_spread <= scene.tolerance;
  std::vector<std::string> teaching;
  for (std::size_t i = 0; i < scene.phases.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const AlignCamera& who = scene.cameras[i];
    if (!camera.reset || who.method != ResetMethod::on_command || !round.cameras[i].stamp) continue;
    if (const auto delay = expected_delay(state, scene.cameras, options, i)) {
      // t_start shall move by tau - tau_reference, and the stamps move with it.
      camera.moment = *round.cameras[i].stamp + *camera.error - delay->mean;
      camera.reason += " at the moment that lands it on the reference";
    } else if (!models_share || std::find(teaching.begin(), teaching.end(), who.model) == teaching.end()) {
      teaching.push_back(who.model);
      camera.reason += ", which teaches how long its reset takes";
    } else {
      camera.reset = false;
      camera.reason = standing(*camera.error, options.row_time) + ", out of tolerance: waits until another " +
                      who.model + " has taught how long a reset takes";
    }
  }
}

/// Orders for the cameras out of tolerance, and a sentence for every camera.
void order_resets(const AlignState& state, AlignDecision& decision, const AlignRound& round,
                  const Scene& scene) {
  const std::size_t reference = *decision.reference;
  const std::vector<bool> chosen = choose_resets(scene, reference);
  for (std::size_t i = 0; i < scene.phases.size(); ++i) {
    CameraDecision& camera = decision.cameras[i];
    const std::string stands = standing(*camera.error, scene.options.row_time);
    camera.reset = chosen[i];
    if (i == reference) {
      camera.reason = "is the reference: the others are brought to its phase";
    } else if (scene.within(i, reference)) {
      camera.reason = stands + ", within tolerance: leave it";
    } else if (!scene.movable(i)) {
      camera.reason = stands + ", out of tolerance, and can't be reset";
    } else if (!chosen[i]) {
      camera.reason = stands + ", out of tolerance: waits, the reference may yet come to it";
    } else if (scene.cameras[i].method == ResetMethod::by_hand) {
      camera.reason = stands + ", out of tolerance: reset its shutter by hand";
    } else {
      camera.reason = stands + ", out of tolerance: its shutter is reset";
    }
  }
  if (scene.options.policy == AlignPolicy::timed) time_resets(state, decision, round, scene);
}

void judge(AlignState& state, AlignDecision& decision, const AlignRound& round, const Scene& scene) {
  state.looks = 0;
  state.reference = decision.reference = choose_reference(scene);
  decision.worst_pair = worst_pair(scene);
  std::size_t out = 0;
  std::string stuck;
  for (std::size_t i = 0; i < scene.phases.size(); ++i) {
    decision.cameras[i].error = scene.error(i, *decision.reference);
    decision.cameras[i].sigma = scene.phases[i].sigma;
    if (scene.within(i, *decision.reference)) continue;
    ++out;
    if (!scene.movable(i)) stuck += (stuck.empty() ? "" : ", ") + scene.cameras[i].id;
  }
  order_resets(state, decision, round, scene);
  if (out == 0) {
    decision.verdict = AlignVerdict::aligned;
    decision.reason = "every camera lies within tolerance of the reference";
  } else if (!stuck.empty()) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason =
        stuck + " can't be reset and lies out of tolerance: make it the reference, or widen the tolerance";
  } else {
    decision.reason = plural(out, "camera") + " out of tolerance";
  }
}

}  // namespace

std::string_view name(AlignPolicy policy) {
  switch (policy) {
    case AlignPolicy::fixed_reference:
      return "fixed-reference";
    case AlignPolicy::densest:
      return "densest";
    case AlignPolicy::timed:
      return "timed";
  }
  return "unknown";
}

AlignStep align_step(const AlignState& before, const AlignRound& round,
                     const std::vector<AlignCamera>& cameras, const AlignOptions& options) {
  AlignState state = before;
  state.cameras.resize(cameras.size());
  ++state.rounds;
  remember(state, round, cameras, options);

  AlignDecision decision;
  decision.round = state.rounds;
  decision.resets_so_far = state.resets;
  decision.cameras.resize(cameras.size());
  Scene scene{cameras, options, {}, options.tolerance.in_time(options.row_time)};
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    decision.cameras[i].state = round.cameras[i].phase.state;
    if (auto phase = phase_now(state.cameras[i], round, options)) scene.phases.push_back(std::move(*phase));
  }
  if (scene.phases.size() < cameras.size()) {
    look_again(state, decision, round, cameras, options);
  } else {
    judge(state, decision, round, scene);
  }

  if (decision.verdict == AlignVerdict::go_on && state.rounds >= options.max_rounds) {
    decision.verdict = AlignVerdict::given_up;
    decision.reason = "not aligned after " + plural(static_cast<std::size_t>(state.rounds), "round") + ": " +
                      decision.reason;
  }
  if (decision.verdict != AlignVerdict::go_on) {
    decision.strobe_phase.reset();
    for (CameraDecision& camera : decision.cameras) {
      camera.reset = false;
      camera.moment.reset();
    }
  }
  return {std::move(state), std::move(decision)};
}

}  // namespace emberlock
