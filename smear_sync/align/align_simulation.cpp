// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/align_simulation.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/random.h"
#include "smear_sync/align/reset_delay.h"

namespace emberlock::smear {
namespace {

constexpr double kLatency = 0.31;    // s, from the order to the start of the first read phase
constexpr double kTransport = 0.07;  // s, from the start of a read phase to the frame's stamp
constexpr double kLead = 0.1;        // s, from the round's instant to what is done after it
constexpr std::uint64_t kStream = 17;

/// A camera: where its read phases start, and how fast it is.
struct Body {
  double start;  // of a read phase, at the instant `since`
  double since;
  double rate;  // parts of one, faster than nominal
  double trim;
  double latency;

  /// tau grows with its rate: starts come earlier.
  void advance(double now) {
    start -= (rate + trim) * (now - since);
    since = now;
  }
};

/// What a dot of a flash `width` rows long says that began to be shifted `k` rows ago: charge moves in whole
/// rows, and a flash that straddles two of them shows in both.
double staircase(double k, double width) {
  const double begin = k - width / 2;
  const double end = k + width / 2;
  const double edge = std::floor(end);
  if (std::floor(begin) == edge) return edge + 0.5;
  return ((edge - begin) * (edge - 0.5) + (end - edge) * (edge + 0.5)) / width;
}

class Rig {
 public:
  Rig(const AlignSimulation& sim, std::uint64_t seed)
      : sim_(sim),
        random_(seed, kStream),
        period_(sim.options.period.value()),
        row_(sim.options.row_time.value()),
        flash_period_(period_ * (1 + sim.period_offset.value() * 1e-6)) {
    const double centre = random_.uniform(0, period_);
    for (int i = 0; i < sim.cameras; ++i) {
      const double rate = random_.normal(0, sim.rate_spread.value()) * 1e-6;
      const double start = sim.spread_rows > 0 ? centre + random_.uniform(-1, 1) * sim.spread_rows * row_
                                               : random_.uniform(0, period_);
      bodies_.push_back({start, now_, rate, 0, kLatency + random_.normal(0, sim.latency_spread.value())});
      cameras_.push_back({"cam" + std::to_string(i), "ccd", sim.method, {}, sim.trim});
      if (!sim.delay_known) continue;
      const Seconds delay(kLatency + kTransport + sim.latency_bias.value());
      cameras_.back().expected_delay =
          ResetDelay{wrap_positive(delay, sim.options.period), milliseconds(0.2)};
    }
  }

  [[nodiscard]] const std::vector<AlignCamera>& cameras() const { return cameras_; }
  [[nodiscard]] double now() const { return now_; }

  AlignRound film() {
    AlignRound round;
    round.at = TimePoint{} + Seconds(now_);
    round.period_offset = {sim_.period_offset + sim_.period_offset_error, PartsPerMillion(5)};
    round.strobe_phase = strobe_phase_;
    round.resets = std::move(resets_);
    round.trims = std::move(trims_);
    resets_.clear();
    trims_.clear();
    for (Body& body : bodies_) round.cameras.push_back(see(body));
    return round;
  }

  void carry_out(const AlignDecision& decision) {
    int count = 0;
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const CameraDecision& camera = decision.cameras[i];
      if (camera.trim) trim(i, *camera.trim);
      if (!camera.reset) continue;
      ++count;
      reset(i, camera.moment);
    }
    if (decision.strobe_phase) strobe_phase_ = *decision.strobe_phase;
    pass(sim_.round_seconds + sim_.reset_seconds * count);
  }

  void pass(double seconds) {
    const double until = now_ + seconds;
    for (const auto& [camera, at, trim] : under_way_) {
      bodies_[camera].advance(at);
      bodies_[camera].trim = trim;
    }
    under_way_.clear();
    for (Body& body : bodies_) body.advance(until);
    now_ = until;
  }

  /// Largest difference to a target, in rows; its tau holds the strobe's delay.
  [[nodiscard]] double worst_rows(Seconds target) const {
    double worst = 0;
    for (const Body& body : bodies_)
      worst = std::max(worst, std::abs(wrap_symmetric(tau(body) - target.value(), period_)) / row_);
    return worst;
  }
  /// How far apart two cameras lie at most.
  [[nodiscard]] double widest_rows() const {
    double worst = 0;
    for (const Body& a : bodies_)
      for (const Body& b : bodies_)
        worst = std::max(worst, std::abs(wrap_symmetric(tau(a) - tau(b), period_)) / row_);
    return worst;
  }

 private:
  struct UnderWay {
    std::size_t camera;
    double at;
    double trim;
  };

  [[nodiscard]] double tau(const Body& body) const {
    const double phase = strobe_phase_.value();
    const double flash = std::round((now_ - phase) / flash_period_) * flash_period_ + phase;
    return wrap_positive(flash - body.start, period_);
  }

  CameraView see(const Body& body) {
    CameraView view;
    const double k = tau(body) / row_;
    const bool hidden =
        k > sim_.visible_rows || k < sim_.bloom_rows || k > sim_.visible_rows - sim_.bloom_rows;
    if (hidden) {
      view.phase = {PhaseState::blind, {}, {}, "no dot"};
    } else {
      const double shown = sim_.flash_rows > 0 ? staircase(k, sim_.flash_rows) : k;
      const Seconds floor =
          sim_.flash_rows > 0
              ? row_resolution(sim_.options.row_time, Rows(sim_.flash_rows) * sim_.options.row_time)
              : Seconds(0);
      const double measured = (shown + random_.normal(0, sim_.noise_rows)) * row_;
      view.phase = {PhaseState::known,
                    wrap_positive(Seconds(measured), sim_.options.period),
                    Seconds(std::hypot(sim_.noise_rows * row_, floor.value())),
                    {}};
    }
    const double stamp = body.start + kTransport;
    view.stamp = TimePoint{} + Seconds(stamp + std::round((now_ - stamp) / period_) * period_);
    return view;
  }

  void reset(std::size_t camera, std::optional<TimePoint> moment) {
    double at = now_ + kLead + random_.uniform(0, period_);
    if (moment) {
      at = (*moment - TimePoint{}).value();
      at += std::ceil((now_ + kLead - at) / period_) * period_;
    }
    Body& body = bodies_[camera];
    body.start = at + body.latency + random_.normal(0, sim_.latency_jitter.value());
    const bool told = sim_.method == ShutterReset::on_command;
    resets_.push_back({camera, told ? std::optional(TimePoint{} + Seconds(at)) : std::nullopt});
  }

  /// In force from a frame's start on, the latency after it was told.
  void trim(std::size_t camera, PartsPerMillion trim) {
    const double told = now_ + kLead;
    const double in_force = told + sim_.trim->latency.value() + random_.uniform(-0.5, 0.5) * period_;
    under_way_.push_back({camera, in_force, trim.value() * 1e-6});
    trims_.push_back({camera, TimePoint{} + Seconds(told), trim});
  }

  const AlignSimulation& sim_;
  RandomStream random_;
  double period_, row_, flash_period_;
  double now_ = 1;
  Seconds strobe_phase_;
  std::vector<Body> bodies_;
  std::vector<AlignCamera> cameras_;
  std::vector<ResetDone> resets_;
  std::vector<TrimDone> trims_;
  std::vector<UnderWay> under_way_;
};

/// Goes on checking when the policy asks for it.
void hold(const AlignSimulation& sim, Rig& rig, AlignOutcome& outcome) {
  AlignDecision decision = outcome.decision;
  const double until = rig.now() + sim.hold_seconds;
  const double tolerance = sim.options.tolerance.in_rows(sim.options.row_time).value();
  while (rig.now() < until) {
    const double wait = decision.next_check ? decision.next_check->value() : 0;
    rig.pass(std::clamp(wait - sim.round_seconds, 0.0, until - rig.now()));
    // What is promised for less than a round can't be kept: cameras at the edge are about to be reset.
    const bool checked = decision.verdict == AlignVerdict::aligned && wait >= 2 * sim.round_seconds;
    const double apart = rig.widest_rows() / 2;
    AlignStep step = align_step(outcome.state, rig.film(), rig.cameras(), sim.options);
    outcome.state = std::move(step.state);
    decision = std::move(step.decision);
    if (checked) {
      ++outcome.checks;
      outcome.held_worst_rows = std::max(outcome.held_worst_rows, apart);
      outcome.late_checks += apart > tolerance ? 1 : 0;
    }
    rig.carry_out(decision);
  }
}

}  // namespace

AlignOutcome simulate(const AlignSimulation& sim, std::uint64_t seed) {
  Rig rig(sim, seed);
  AlignOutcome outcome;
  const double began = rig.now();
  for (;;) {
    const AlignRound round = rig.film();
    AlignStep step = align_step(outcome.state, round, rig.cameras(), sim.options);
    outcome.state = std::move(step.state);
    outcome.decision = std::move(step.decision);
    if (outcome.decision.verdict != AlignVerdict::go_on) {
      outcome.words = words(outcome.decision, round, rig.cameras(), sim.options);
      break;
    }
    rig.carry_out(outcome.decision);
  }
  outcome.resets = outcome.state.resets;
  outcome.rounds = outcome.state.rounds;
  outcome.seconds = rig.now() - began + sim.round_seconds;
  if (outcome.decision.target) outcome.true_worst_rows = rig.worst_rows(*outcome.decision.target);
  if (outcome.decision.verdict != AlignVerdict::aligned || sim.hold_seconds <= 0) return outcome;
  rig.carry_out(outcome.decision);
  hold(sim, rig, outcome);
  return outcome;
}

AlignStatistics summarise(const std::vector<AlignOutcome>& outcomes) {
  AlignStatistics s;
  s.rigs = static_cast<int>(outcomes.size());
  std::vector<int> resets;
  std::vector<double> seconds;
  for (const AlignOutcome& o : outcomes) {
    s.aligned += o.decision.verdict == AlignVerdict::aligned ? 1 : 0;
    s.resets += static_cast<double>(o.resets) / s.rigs;
    s.seconds += o.seconds / s.rigs;
    s.rounds += static_cast<double>(o.rounds) / s.rigs;
    if (o.decision.verdict == AlignVerdict::aligned)
      s.true_worst_rows = std::max(s.true_worst_rows, o.true_worst_rows);
    resets.push_back(o.resets);
    seconds.push_back(o.seconds);
  }
  if (outcomes.empty()) return s;
  std::sort(resets.begin(), resets.end());
  std::sort(seconds.begin(), seconds.end());
  const auto at = static_cast<std::size_t>(0.95 * (s.rigs - 1));
  s.resets_p95 = resets[at];
  s.seconds_p95 = seconds[at];
  s.seconds_worst = seconds.back();
  return s;
}

AlignStatistics simulate_many(const AlignSimulation& simulation, int rigs, std::uint64_t first_seed) {
  std::vector<AlignOutcome> outcomes;
  outcomes.reserve(static_cast<std::size_t>(rigs));
  for (int i = 0; i < rigs; ++i)
    outcomes.push_back(simulate(simulation, first_seed + static_cast<std::uint64_t>(i)));
  return summarise(outcomes);
}

}  // namespace emberlock::smear
