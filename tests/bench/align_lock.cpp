// How long virtual cameras take from cold to locked, and whether a lock that is held is ever wrong:
//   bench_align_lock cold SEEDS    11 cameras to +-100 rows, by each policy, in seconds of the rig's time
//   bench_align_lock hold HOURS    11 cameras held, the truth asked every second
// Pictures of 320 x 240 whose 240 rows take as long as the paper's 720, so that 100 of the paper's rows are
// 5.4 ms.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <string>
#include <vector>

#include "daemon/align/alignment.h"
#include "tests/support/small_rig.h"

namespace emberlock {
namespace {

constexpr Seconds kTolerance = milliseconds(5.4);

test::SmallBench bench_of(std::uint64_t seed, AlignPolicy policy) {
  VirtualRigOptions setup = test::small_rig(seed, 11);
  test::SmallBench bench(setup);
  bench.options.comb_frames = 24;
  bench.options.align.policy = policy;
  bench.options.align.tolerance.amount = kTolerance;
  bench.options.align.reset_by = ResetBy::anybody;  // as the daemon has it
  bench.options.seed = seed;
  return bench;
}

int cold(int seeds) {
  for (const AlignPolicy policy : {AlignPolicy::fixed_reference, AlignPolicy::densest, AlignPolicy::timed}) {
    std::vector<double> seconds;
    double resets = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      test::SmallBench bench = bench_of(static_cast<std::uint64_t>(seed), policy);
      const TimePoint began = bench.align.clock->now();
      const auto result = run_align(bench.align, bench.options);
      if (!result || result->last.verdict != AlignVerdict::aligned) {
        std::printf("seed %d: %s\n", seed,
                    result ? result->last.reason.c_str() : result.error().message().c_str());
        continue;
      }
      seconds.push_back((bench.align.clock->now() - began).value());
      resets += result->resets;
    }
    std::sort(seconds.begin(), seconds.end());
    const auto n = static_cast<double>(seconds.size());
    std::printf("%-16s %d of %d locked; mean %.1f s, 95 %% %.1f s, worst %.1f s; %.1f resets\n",
                std::string(name(policy)).c_str(), static_cast<int>(n), seeds,
                std::accumulate(seconds.begin(), seconds.end(), 0.0) / n,
                seconds[static_cast<std::size_t>(0.95 * (n - 1))], seconds.back(), resets / n);
    std::fflush(stdout);
  }
  return 0;
}

int hold(double hours) {
  test::SmallBench bench = bench_of(1, AlignPolicy::timed);
  const auto made = Alignment::create(bench.align, bench.options);
  if (!made || !(*made)->start()) return 1;
  Alignment& alignment = **made;
  Clock& clock = *bench.align.clock;
  const TimePoint end = clock.now() + Seconds(3600 * hours);
  double worst = 0;  // ms, while it said locked
  int wrong = 0;
  double unlocked = 0;
  const auto look = [&](TimePoint now) {
    if (!alignment.locked(now)) return;
    const double error = in_milliseconds(bench.true_error(SecondsPerRow(1)).value() * Seconds(1));
    worst = std::max(worst, error);
    wrong += error > in_milliseconds(kTolerance) ? 1 : 0;
  };
  while (clock.now() < end) {
    if (!alignment.round()) return 1;
    look(clock.now());
    const TimePoint next = clock.now() + alignment.next_check(clock.now());
    if (!alignment.locked(clock.now())) unlocked += alignment.options().round_time.value();
    while (clock.now() + Seconds(1) < next) {
      alignment.wait(clock.now() + Seconds(1));
      look(clock.now());
    }
    alignment.wait(next);
  }
  std::printf(
      "%g h: %d checks, %d resets, %d rounds, about %.0f s not locked; worst true error while locked "
      "%.3f ms of %.1f ms, %d instants out\n",
      hours, alignment.checks(), alignment.resets(), alignment.last().round, unlocked, worst,
      in_milliseconds(kTolerance), wrong);
  return wrong == 0 ? 0 : 1;
}

}  // namespace
}  // namespace emberlock

int main(int count, char** arguments) {
  const std::string what = count > 1 ? arguments[1] : "cold";
  const double much = count > 2 ? std::atof(arguments[2]) : (what == "hold" ? 24 : 100);
  return what == "hold" ? emberlock::hold(much) : emberlock::cold(static_cast<int>(much));
}
