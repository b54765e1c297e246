#pragma once

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "base/random.h"
#include "smear_sync/align.h"

namespace emberlock::test {

/// Cameras and strobe as bare numbers on one time axis: what align_step is judged against, without pictures.
struct AlignSimulation {
  int cameras = 11;
  AlignOptions options;
  bool delay_known = false;  ///< whether align_step is told the mean delay of the model
  ResetMethod method = ResetMethod::on_command;
  Seconds latency_jitter = milliseconds(0.2);
  Seconds latency_spread = milliseconds(0);  ///< of the cameras' mean latencies
  Seconds latency_bias{0};                   ///< by which the delay told is wrong
  PartsPerMillion rate_spread{0};            ///< of the cameras' periods
  PartsPerMillion beat{167};                 ///< strobe period against the cameras', as 23.98 against 23.976
  PartsPerMillion beat_error{2};             ///< by which the beat told is wrong
  double noise_rows = 0.3;
  double bloom_rows = 25;  ///< phases this near to the lamp show no dot, nor does the rest after 720 rows
  double round_seconds = 0.6;
};

struct AlignOutcome {
  AlignDecision decision;
  int resets = 0;
  int rounds = 0;
  double true_worst_rows = 0;  ///< largest true difference to the reference at the end
};

inline AlignOutcome simulate(const AlignSimulation& sim, std::uint64_t seed) {
  struct Body {
    double start, period, latency;
  };
  constexpr double kLatency = 0.31;    // s, from the order to the start of the first read phase
  constexpr double kTransport = 0.07;  // s, from the start of a read phase to the frame's stamp
  RandomStream random(seed, 17);
  const double T = sim.options.period.value();
  const double row = sim.options.row_time.value();
  std::vector<Body> bodies;
  std::vector<AlignCamera> cameras;
  for (int i = 0; i < sim.cameras; ++i) {
    const double period = T * (1 + random.normal(0, sim.rate_spread.value()) * 1e-6);
    bodies.push_back({random.uniform(0, T), period, kLatency + random.normal(0, sim.latency_spread.value())});
    cameras.push_back({"cam" + std::to_string(i), "ccd", sim.method, {}});
    if (sim.delay_known) {
      const Seconds delay(kLatency + kTransport + sim.latency_bias.value());
      cameras.back().expected_delay = ResetDelay{wrap_positive(delay, sim.options.period), milliseconds(0.2)};
    }
  }
  const double flash_period = T * (1 + sim.beat.value() * 1e-6);
  const auto tau_at = [&](const Body& b, double now, double strobe_phase) {
    const double flash = std::round((now - strobe_phase) / flash_period) * flash_period + strobe_phase;
    return wrap_positive(flash - b.start, b.period);
  };

  AlignState state;
  AlignOutcome outcome;
  double now = 1;
  Seconds strobe_phase;
  std::vector<ResetDone> done;
  for (;;) {
    AlignRound round;
    round.at = TimePoint{} + Seconds(now);
    round.beat = {sim.beat + sim.beat_error, PartsPerMillion(5)};
    round.strobe_phase = strobe_phase;
    round.resets = done;
    for (const Body& b : bodies) {
      CameraView view;
      const double tau = tau_at(b, now, strobe_phase.value());
      const double k = tau / row;
      if (k > 720 || k < sim.bloom_rows || k > 720 - sim.bloom_rows) {
        view.phase = {PhaseState::blind, {}, {}, "no dot"};
      } else {
        const double measured = tau + random.normal(0, sim.noise_rows) * row;
        view.phase = {PhaseState::known,
                      wrap_positive(Seconds(measured), sim.options.period),
                      Seconds(sim.noise_rows * row),
                      {}};
      }
      const double stamp = b.start + kTransport;
      view.stamp = TimePoint{} + Seconds(stamp + std::round((now - stamp) / b.period) * b.period);
      round.cameras.push_back(view);
    }
    AlignStep step = align_step(state, round, cameras, sim.options);
    state = std::move(step.state);
    outcome.decision = std::move(step.decision);
    const AlignDecision& decision = outcome.decision;
    if (decision.verdict != AlignVerdict::go_on) {
      outcome.resets = state.resets;
      outcome.rounds = state.rounds;
      if (!decision.reference) return outcome;
      for (const Body& b : bodies) {
        const double difference = tau_at(b, now, 0) - tau_at(bodies[*decision.reference], now, 0);
        outcome.true_worst_rows =
            std::max(outcome.true_worst_rows, std::abs(wrap_symmetric(difference, T)) / row);
      }
      return outcome;
    }
    done.clear();
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      if (!decision.cameras[i].reset) continue;
      double at = now + 0.1 + random.uniform(0, T);
      if (const auto moment = decision.cameras[i].moment) {
        at = (*moment - TimePoint{}).value();
        at += std::ceil((now + 0.1 - at) / T) * T;
      }
      bodies[i].start = at + bodies[i].latency + random.normal(0, sim.latency_jitter.value());
      const bool told = sim.method == ResetMethod::on_command;
      done.push_back({i, told ? std::optional(TimePoint{} + Seconds(at)) : std::nullopt});
    }
    if (decision.strobe_phase) strobe_phase = *decision.strobe_phase;
    now += sim.round_seconds;
  }
}

struct ResetCounts {
  double mean = 0;
  int p95 = 0;
  int aligned = 0;
  double mean_rounds = 0;
};

inline ResetCounts count_resets(const AlignSimulation& sim, int seeds) {
  ResetCounts counts;
  std::vector<int> resets;
  for (int seed = 0; seed < seeds; ++seed) {
    const AlignOutcome outcome = simulate(sim, static_cast<std::uint64_t>(seed));
    counts.aligned += outcome.decision.verdict == AlignVerdict::aligned ? 1 : 0;
    counts.mean += static_cast<double>(outcome.resets) / seeds;
    counts.mean_rounds += static_cast<double>(outcome.rounds) / seeds;
    resets.push_back(outcome.resets);
  }
  std::sort(resets.begin(), resets.end());
  counts.p95 = resets[static_cast<std::size_t>(0.95 * (seeds - 1))];
  return counts;
}

}  // namespace emberlock::test
