// SPDX-License-Identifier: Apache-2.0
#include "evaluate/sync_tradeoff.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/random.h"
#include "evaluate/option_range.h"
#include "recon/compute/pool.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"

namespace emberlock::evaluate {
namespace {

constexpr int kViews = 10;  // of the flame, plus one held-out view
constexpr int kMostRounds = 600;
constexpr double kHopeless = 1000;  // expected resets above which nothing is simulated
constexpr double kSteps[] = {1, 2, 5, 10, 20, 50, 100, 200};
constexpr smear::AlignPolicy kPolicies[] = {smear::AlignPolicy::fixed_reference, smear::AlignPolicy::densest,
                                            smear::AlignPolicy::timed, smear::AlignPolicy::trimmed};

bool by_hand(smear::AlignPolicy policy) { return policy < smear::AlignPolicy::timed; }

Status check(const SyncTradeoffOptions& o) {
  const double half = 0.5 / o.frame_rate.value() / o.row_time.value();
  EMBERLOCK_RETURN_IF_ERROR(in_range("--frame-rate", o.frame_rate.value(), 1, 1000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--row-time-us", o.row_time.value() * 1e6, 1, 1000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--cameras", o.cameras, 2, 64));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--latency-jitter", in_milliseconds(o.latency_jitter), 1e-3, 1000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--latency-spread", in_milliseconds(o.latency_spread), 0, 1000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--crystal-spread", o.crystal_spread.value(), 0, 500));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--reset-seconds", o.reset_time.value(), 0, 3600));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--round-seconds", o.round_time.value(), 0.05, 60));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--trim-range", o.trim_range.value(), 1, 1000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--trim-step", o.trim_step.value(), 1e-3, o.trim_range.value() / 4));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--rigs", o.rigs, 20, 100000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--flame-speed", o.flame_speed, 0, 100));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--voxels", o.voxels, 16, 128));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--draws", o.draws, 1, 100));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--added-error", o.added_error, 0.1, 1000));
  for (const Rows tolerance : o.tolerances)
    EMBERLOCK_RETURN_IF_ERROR(in_range("--tolerances", tolerance.value(), 0.5, half));
  return {};
}

SyncTradeoffOptions completed(SyncTradeoffOptions o) {
  const double half = 0.5 / o.frame_rate.value() / o.row_time.value();
  if (o.tolerances.empty()) {
    for (const double rows : kSteps)
      if (rows < half) o.tolerances.emplace_back(rows);
  }
  std::sort(o.tolerances.begin(), o.tolerances.end());
  o.tolerances.erase(std::unique(o.tolerances.begin(), o.tolerances.end()), o.tolerances.end());
  if (o.policies.empty()) o.policies.assign(std::begin(kPolicies), std::end(kPolicies));
  return o;
}

smear::AlignSimulation simulation_of(const SyncTradeoffOptions& o, smear::AlignPolicy policy,
                                     Rows tolerance) {
  smear::AlignSimulation sim;
  sim.cameras = o.cameras;
  sim.options.policy = policy;
  sim.options.tolerance = {tolerance};
  sim.options.period = period(o.frame_rate);
  sim.options.row_time = o.row_time;
  sim.options.delay_jitter = o.latency_jitter;
  sim.options.rate_spread = o.crystal_spread;
  sim.options.max_rounds = kMostRounds;
  sim.options.round_time = o.round_time;
  sim.options.reset_time = by_hand(policy) ? o.reset_time : Seconds(0);
  sim.method = by_hand(policy) ? ShutterReset::by_hand : ShutterReset::on_command;
  sim.latency_jitter = o.latency_jitter;
  sim.latency_spread = o.latency_spread;
  sim.rate_spread = o.crystal_spread;
  sim.flash_rows = std::min(1.0, 20e-6 / o.row_time.value());
  sim.noise_rows = 0.08;  // four dots of 0.16 rows each
  sim.visible_rows = std::min(720.0, 0.93 * (sim.options.period / o.row_time).value());
  sim.round_seconds = o.round_time.value();
  sim.reset_seconds = sim.options.reset_time.value();
  if (policy == smear::AlignPolicy::trimmed)
    sim.trim = FrameRateTrim{o.trim_range, o.trim_step, 2 * sim.options.period};
  return sim;
}

/// Approximate minimum of resets by hand that a policy needs. Each reset succeeds with this probability.
double expected_by_hand(const SyncTradeoffOptions& o, Rows tolerance) {
  const double lands = 2 * (tolerance * o.row_time / period(o.frame_rate));
  return 0.6 * o.cameras / std::min(1.0, lands);
}

SyncCost cost_of(const SyncTradeoffOptions& o, smear::AlignPolicy policy, Rows tolerance, recon::Pool& pool) {
  SyncCost cost{policy, tolerance, {}, 0};
  if (by_hand(policy)) {
    cost.expected = expected_by_hand(o, tolerance);
    if (cost.expected > kHopeless) return cost;
  }
  const smear::AlignSimulation sim = simulation_of(o, policy, tolerance);
  std::vector<smear::AlignOutcome> outcomes(static_cast<std::size_t>(o.rigs));
  pool.run(o.rigs, [&](int i) {
    outcomes[static_cast<std::size_t>(i)] =
        smear::simulate(sim, o.seed * 1'000'000 + static_cast<std::uint64_t>(i));
  });
  cost.statistics = smear::summarise(outcomes);
  return cost;
}

/// Held-out error of a flame filmed by cameras with these delays.
Result<double> flame_error(const SyncTradeoffOptions& o, std::vector<Seconds> lateness) {
  recon::PaperSceneOptions scene;
  scene.flame.seed = o.seed;
  scene.flame.rise_speed = o.flame_speed;
  scene.flame.extinction = PerMeter(
      0);  // emission only: with extinction, the medium would have to be found in every reconstruction
  scene.image = {4 * o.voxels, 3 * o.voxels};
  scene.truth_voxels = 3 * o.voxels / 2;
  scene.truth_step = 1;
  scene.lateness = std::move(lateness);
  recon::ReconstructOptions reconstruction;
  reconstruction.voxels = o.voxels;
  reconstruction.solve.compute.threads = o.threads;
  EMBERLOCK_ASSIGN_OR_RETURN(reconstruction.effects, recon::parse_effects("none"));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Outcome outcome,
                             recon::reconstruct(recon::paper_scene(scene), reconstruction, SteadyClock{}));
  const recon::ChannelRmse& rmse = *outcome.report.heldout_rmse;
  return std::sqrt((rmse[0] * rmse[0] + rmse[1] * rmse[1] + rmse[2] * rmse[2]) / 3);
}

/// Uses the same random draws, scaled, for every tolerance, so that only the tolerance differs.
Status measure_errors(SyncTradeoff& result, const Progress& progress) {
  const SyncTradeoffOptions& o = result.options;
  const double runs = 1 + static_cast<double>(o.tolerances.size()) * o.draws;
  double done = 0;
  const auto next = [&] { tell(progress, 0.5 + 0.5 * done++ / runs, "reconstructing the rising flame"); };
  next();
  EMBERLOCK_ASSIGN_OR_RETURN(result.floor, flame_error(o, {}));
  for (const Rows tolerance : o.tolerances) {
    double sum = 0;
    double squares = 0;
    for (int draw = 0; draw < o.draws; ++draw) {
      next();
      std::vector<Seconds> lateness;
      for (int view = 0; view < kViews; ++view) {
        const double u =
            random_uniform(o.seed, 100 + static_cast<std::uint64_t>(draw), static_cast<std::uint64_t>(view));
        lateness.push_back(tolerance * o.row_time * (2 * u - 1));
      }
      EMBERLOCK_ASSIGN_OR_RETURN(const double error, flame_error(o, std::move(lateness)));
      sum += error;
      squares += error * error;
    }
    const double mean = sum / o.draws;
    const double variance = o.draws > 1 ? std::max(0.0, squares - sum * mean) / (o.draws - 1) : 0;
    result.errors.push_back({tolerance, mean, std::sqrt(variance / o.draws)});
  }
  return {};
}

/// "densest takes 18.6 resets (95 %: 33) in 3.3 min (95 %: 5.8 min)"
std::string effort_text(const SyncCost& cost) {
  const smear::AlignStatistics& s = cost.statistics;
  return fmt::format("{} takes {:.1f} resets (95 %: {}) in {} (95 %: {})", name(cost.policy), s.resets,
                     s.resets_p95, time_text(s.seconds), time_text(s.seconds_p95));
}

/// What resets by hand reach, for rigs whose cameras accept no commands.
std::string by_hand_text(const SyncTradeoff& t) {
  const SyncCost* best = nullptr;
  for (const SyncCost& cost : t.costs) {
    if (!by_hand(cost.policy) || !cost.reached()) continue;
    const bool finer = best == nullptr || cost.tolerance < best->tolerance;
    const bool quicker = best != nullptr && cost.tolerance == best->tolerance &&
                         cost.statistics.seconds < best->statistics.seconds;
    if (finer || quicker) best = &cost;
  }
  if (best == nullptr) return "";
  return " By hand alone the finest that is met is " + tolerance_text(t, best->tolerance) + ": " +
         effort_text(*best) + ".";
}

double added_percent(const SyncTradeoff& t, const SyncError& e) { return 100 * (e.error / t.floor - 1); }

/// Recommends the largest tolerance that, like all smaller ones, adds little enough error; and the policy for
/// it.
void recommend(SyncTradeoff& t) {
  if (t.errors.empty()) {
    t.why = "Without a flame's speed nothing says which tolerance is enough: give --flame-speed.";
    return;
  }
  std::size_t enough = 0;
  while (enough < t.errors.size() && added_percent(t, t.errors[enough]) <= t.options.added_error) ++enough;
  const std::string at_speed = fmt::format("At {:g} m/s ", t.options.flame_speed);
  if (enough == 0) {
    t.why = at_speed + fmt::format(
                           "even {} add {:.1f} % to the reconstruction's error of {:.2f} grey levels: "
                           "give smaller --tolerances, or allow a larger --added-error.",
                           tolerance_text(t, t.errors[0].tolerance), added_percent(t, t.errors[0]), t.floor);
    return;
  }
  const SyncError& chosen = t.errors[enough - 1];
  const SyncCost* cost = cheapest(t, chosen.tolerance);
  t.why = at_speed + fmt::format("{} add {:.1f} % to the reconstruction's error of {:.2f} grey levels",
                                 tolerance_text(t, chosen.tolerance), added_percent(t, chosen), t.floor);
  if (enough < t.errors.size())
    t.why += fmt::format("; {} would add {:.1f} %", tolerance_text(t, t.errors[enough].tolerance),
                         added_percent(t, t.errors[enough]));
  if (cost == nullptr) {
    t.why += ". No policy reaches it in 95 rigs of 100.";
    return;
  }
  t.recommended = static_cast<std::size_t>(cost - t.costs.data());
  t.why += ". Quickest: " + effort_text(*cost) + ".";
  if (!by_hand(cost->policy)) t.why += by_hand_text(t);
}

void say_next_step(SyncTradeoff& t) {
  const SyncTradeoffOptions& o = t.options;
  t.next_step = fmt::format(
      "This took {:.0f} s of simulated rigs and {:.0f} s of reconstructions. Four times "
      "the rigs (--rigs {}) halve the error of the means and take about {:.0f} s",
      t.simulating.value(), t.reconstructing.value(), 4 * o.rigs, 4 * t.simulating.value());
  if (!t.errors.empty())
    t.next_step += fmt::format(
        "; four times the draws (--draws {}) that of the added errors, about {:.0f} s; "
        "a third finer voxels (--voxels {}) take about {:.0f} s",
        4 * o.draws, 4 * t.reconstructing.value(), o.voxels * 4 / 3, 2.4 * t.reconstructing.value());
  t.next_step += ".";
}

}  // namespace

std::string time_text(double seconds) {
  return seconds < 90 ? fmt::format("{:.1f} s", seconds) : fmt::format("{:.1f} min", seconds / 60);
}

std::string tolerance_text(const SyncTradeoff& t, Rows tolerance) {
  return fmt::format("\u00b1{:g} rows ({:.3g} ms)", tolerance.value(),
                     in_milliseconds(tolerance * t.options.row_time));
}

const SyncCost* cheapest(const SyncTradeoff& tradeoff, Rows tolerance) {
  const SyncCost* best = nullptr;
  for (const SyncCost& cost : tradeoff.costs) {
    if (cost.tolerance != tolerance || !cost.reached()) continue;
    if (best == nullptr || cost.statistics.seconds < best->statistics.seconds) best = &cost;
  }
  return best;
}

Result<SyncTradeoff> measure_sync_tradeoff(const SyncTradeoffOptions& asked, const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(check(asked));
  SyncTradeoff result;
  result.options = completed(asked);
  const SyncTradeoffOptions& o = result.options;
  const SteadyClock clock;
  const TimePoint start = clock.now();
  recon::Pool pool(o.threads);
  const double share = o.flame_speed > 0 ? 0.5 : 1;
  const auto points = static_cast<double>(o.policies.size() * o.tolerances.size());
  for (const smear::AlignPolicy policy : o.policies) {
    for (const Rows tolerance : o.tolerances) {
      tell(progress, share * static_cast<double>(result.costs.size()) / points,
           fmt::format("{} to {:g} rows", name(policy), tolerance.value()));
      result.costs.push_back(cost_of(o, policy, tolerance, pool));
    }
  }
  const TimePoint middle = clock.now();
  result.simulating = middle - start;
  if (o.flame_speed > 0) EMBERLOCK_RETURN_IF_ERROR(measure_errors(result, progress));
  result.reconstructing = clock.now() - middle;
  recommend(result);
  say_next_step(result);
  tell(progress, 1, "done");
  return result;
}

std::string repeat_command(const SyncTradeoff& t, const SyncCost& cost) {
  const SyncTradeoffOptions& o = t.options;
  const SyncTradeoffOptions standard;
  std::string words = fmt::format("emberlock tradeoff sync --out point --policies {} --tolerances {}",
                                  name(cost.policy), cost.tolerance.value());
  const auto add = [&](const char* option, auto value, auto usual) {
    if (value != usual) words += fmt::format(" {} {}", option, value);
  };
  add("--cameras", o.cameras, standard.cameras);
  add("--frame-rate", o.frame_rate.value(), standard.frame_rate.value());
  add("--row-time-us", o.row_time.value() * 1e6, standard.row_time.value() * 1e6);
  add("--latency-jitter", in_milliseconds(o.latency_jitter), in_milliseconds(standard.latency_jitter));
  add("--latency-spread", in_milliseconds(o.latency_spread), in_milliseconds(standard.latency_spread));
  add("--crystal-spread", o.crystal_spread.value(), standard.crystal_spread.value());
  add("--reset-seconds", o.reset_time.value(), standard.reset_time.value());
  add("--round-seconds", o.round_time.value(), standard.round_time.value());
  add("--trim-range", o.trim_range.value(), standard.trim_range.value());
  add("--trim-step", o.trim_step.value(), standard.trim_step.value());
  add("--rigs", o.rigs, standard.rigs);
  add("--seed", o.seed, standard.seed);
  add("--flame-speed", o.flame_speed, standard.flame_speed);
  add("--voxels", o.voxels, standard.voxels);
  add("--draws", o.draws, standard.draws);
  add("--added-error", o.added_error, standard.added_error);
  return words;
}

}  // namespace emberlock::evaluate
