// SPDX-License-Identifier: Apache-2.0
// What each policy takes to bring 11 cameras within a tolerance: resets and seconds, mean and 95th percentile
// over fresh rigs.
//   bench_align_policies [RIGS [FIRST_SEED]]
#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "smear_sync/align/align_simulation.h"

namespace {

using namespace emberlock;

smear::AlignSimulation by_resets(smear::AlignPolicy policy, double rows) {
  smear::AlignSimulation sim;
  sim.options.policy = policy;
  sim.options.tolerance = {Rows(rows)};
  sim.options.max_rounds = 2000;
  return sim;
}

/// From +-100 rows. Phases as four frames of a 20 us flash show them: whole-row shifts, and 0.16 rows a dot.
smear::AlignSimulation by_trims(PartsPerMillion crystals) {
  smear::AlignSimulation sim = by_resets(smear::AlignPolicy::trimmed, 1);
  sim.trim = FrameRateTrim{PartsPerMillion(100), PartsPerMillion(0.5), milliseconds(80)};
  sim.flash_rows = 20.0 / 54;
  sim.noise_rows = 0.08;
  sim.rate_spread = crystals;
  sim.spread_rows = 100;
  sim.round_seconds = 0.3;
  sim.options.round_time = Seconds(0.3);
  return sim;
}

smear::AlignSimulation known(smear::AlignSimulation sim) {
  sim.delay_known = true;
  return sim;
}
smear::AlignSimulation latencies(smear::AlignSimulation sim, Seconds spread) {
  sim.latency_spread = spread;
  return sim;
}
smear::AlignSimulation drifting(smear::AlignSimulation sim) {
  sim.rate_spread = PartsPerMillion(10);
  return sim;
}
smear::AlignSimulation anywhere(smear::AlignSimulation sim) {
  sim.spread_rows = 0;
  sim.delay_known = true;
  return sim;
}

}  // namespace

int main(int argc, char** argv) {
  const int rigs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 1000;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 1'000'000);
  std::printf(
      "11 cameras, T = 1/23.976 s, t_row = 54 us (T / t_row = %.1f), latency jitter 0.2 ms; %d rigs "
      "from seed %llu\n",
      1 / 23.976 / 54e-6, rigs, static_cast<unsigned long long>(seed));
  std::printf(
      "trims: +-100 ppm in steps of 0.5 ppm, in force 80 ms after the order, give or take half a "
      "frame; 20 us flash\n");
  std::printf("%-58s %9s %7s %5s %8s %6s %6s %8s %7s\n", "policy", "tolerance", "resets", "p95", "seconds",
              "p95", "worst", "aligned", "error");
  const auto print = [&](const char* name, const smear::AlignSimulation& sim) {
    const smear::AlignStatistics s = smear::simulate_many(sim, rigs, seed);
    std::printf("%-58s %4.0f rows %7.2f %5d %8.1f %6.1f %6.1f %7.1f%% %7.2f\n", name,
                std::get<Rows>(sim.options.tolerance.amount).value(), s.resets, s.resets_p95, s.seconds,
                s.seconds_p95, s.seconds_worst, 100.0 * s.aligned / s.rigs, s.true_worst_rows);
  };
  for (const double rows : {100.0, 10.0}) {
    print("fixed-reference", by_resets(smear::AlignPolicy::fixed_reference, rows));
    print("densest", by_resets(smear::AlignPolicy::densest, rows));
    print("densest, cameras drift by 10 ppm", drifting(by_resets(smear::AlignPolicy::densest, rows)));
    const smear::AlignSimulation timed = by_resets(smear::AlignPolicy::timed, rows);
    print("timed, each camera's delay known", known(timed));
    print("timed, delay known, cameras drift by 10 ppm", drifting(known(timed)));
    print("timed, from scratch, one delay +- 0.1 ms", latencies(timed, milliseconds(0.1)));
    print("timed, from scratch, delays +- 10 ms", latencies(timed, milliseconds(10)));
  }
  print("trimmed, from +-100 rows, equal crystals", by_trims(PartsPerMillion(0)));
  print("trimmed, from +-100 rows, crystals +- 10 ppm", by_trims(PartsPerMillion(10)));
  print("trimmed, from anywhere, delay known, crystals +- 10 ppm", anywhere(by_trims(PartsPerMillion(10))));
}
