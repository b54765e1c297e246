// Resets that each policy takes to bring 11 cameras within a tolerance: mean and 95th percentile over 1000
// seeds.
//   bench_align_policies [SEEDS]
#include <cstdio>
#include <cstdlib>

#include "tests/support/align_simulation.h"

int main(int argc, char** argv) {
  using namespace emberlock;
  const int seeds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 1000;
  struct Row {
    const char* name = nullptr;
    AlignPolicy policy{};
    bool delay_known = false;
    Seconds latency_spread{};                // of the cameras' mean latencies, in truth
    Seconds told_spread = milliseconds(10);  // and as the policy is told
    PartsPerMillion drift{};
  };
  const Row rows[] = {
      {"fixed-reference", AlignPolicy::fixed_reference},
      {"densest", AlignPolicy::densest},
      {"timed, each camera's delay known", AlignPolicy::timed, true},
      {"timed, the model's delay to be learnt", AlignPolicy::timed, false, milliseconds(0.1),
       milliseconds(0.1)},
      {"timed, each camera's delay to be learnt", AlignPolicy::timed, false, milliseconds(10)},
      {"fixed-reference, cameras drift by 10 ppm",
       AlignPolicy::fixed_reference,
       false,
       {},
       milliseconds(10),
       PartsPerMillion(10)},
      {"densest, cameras drift by 10 ppm",
       AlignPolicy::densest,
       false,
       {},
       milliseconds(10),
       PartsPerMillion(10)},
      {"timed, delay known, cameras drift by 10 ppm",
       AlignPolicy::timed,
       true,
       {},
       milliseconds(10),
       PartsPerMillion(10)},
  };
  std::printf(
      "11 cameras, T = 1/23.976 s, t_row = 54 us (T / t_row = %.1f), latency jitter 0.2 ms, %d seeds\n",
      1 / 23.976 / 54e-6, seeds);
  std::printf("%-46s %9s %8s %5s %8s %8s\n", "policy", "tolerance", "mean", "p95", "rounds", "aligned");
  for (const double tolerance : {100.0, 10.0}) {
    for (const Row& row : rows) {
      test::AlignSimulation sim;
      sim.options.policy = row.policy;
      sim.options.tolerance = {Rows(tolerance)};
      sim.options.max_rounds = 2000;
      sim.options.delay_spread = row.told_spread;
      sim.delay_known = row.delay_known;
      sim.latency_spread = row.latency_spread;
      sim.rate_spread = row.drift;
      const test::ResetCounts counts = test::count_resets(sim, seeds);
      std::printf("%-46s %4.0f rows %8.2f %5d %8.1f %7.1f%%\n", row.name, tolerance, counts.mean, counts.p95,
                  counts.mean_rounds, 100.0 * counts.aligned / seeds);
    }
  }
}
