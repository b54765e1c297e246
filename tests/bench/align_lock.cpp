// SPDX-License-Identifier: Apache-2.0
// How long virtual cameras take from cold to locked, and whether a lock that is held is ever wrong:
//   bench_align_lock cold SEEDS    11 cameras to +-100 rows, by each policy, in seconds of the rig's time
//   bench_align_lock hold HOURS    11 cameras whose crystals wander, held; the truth asked every second; a
//                                  line for each hour
// Pictures of 320 x 240 whose 240 rows take as long as the paper's 720, so that 100 of the paper's rows are
// 5.4 ms.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numeric>
#include <string>
#include <vector>

#include "rig/align/alignment.h"
#include "tests/support/small_rig.h"

namespace emberlock {
namespace {

constexpr Seconds kTolerance = milliseconds(5.4);

/// Within an hour, as the temperature of a room and of the cameras goes.
constexpr PartsPerMillion kWander{2};

test::SmallBench bench_of(std::uint64_t seed, smear::AlignPolicy policy, PartsPerMillion wander = {}) {
  drivers::VirtualRigOptions setup = test::small_rig(seed, 11);
  for (drivers::VirtualCameraOptions& camera : setup.cameras) camera.wander = wander;
  test::SmallBench bench(setup);
  bench.options.comb_frames = 24;
  bench.options.align.policy = policy;
  bench.options.align.tolerance.amount = kTolerance;
  bench.options.align.reset_by = smear::ResetBy::anybody;  // as the daemon has it
  bench.options.seed = seed;
  return bench;
}

int cold(int seeds) {
  for (const smear::AlignPolicy policy :
       {smear::AlignPolicy::fixed_reference, smear::AlignPolicy::densest, smear::AlignPolicy::timed}) {
    std::vector<double> seconds;
    double resets = 0;
    for (int seed = 1; seed <= seeds; ++seed) {
      test::SmallBench bench = bench_of(static_cast<std::uint64_t>(seed), policy);
      const TimePoint began = bench.align.clock->now();
      const auto result = rig::run_align(bench.align, bench.options);
      if (!result || result->last.verdict != smear::AlignVerdict::aligned) {
        std::printf("seed %d: %s\n", seed,
                    result ? result->words.reason.c_str() : result.error().message().c_str());
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

/// What an hour of holding came to, and all of them.
struct Held {
  double seconds = 0;
  double unlocked = 0;  ///< of them
  int checks = 0;       ///< rounds while locked
  int renewals = 0;     ///< times that cameras were reset before they left
  int losses = 0;       ///< times that the lock was given up
  int resets = 0;
  double worst = 0;  ///< true error while it said locked, ms
  int out = 0;       ///< instants at which it said locked and wasn't

  void add(const Held& other) {
    seconds += other.seconds;
    unlocked += other.unlocked;
    checks += other.checks;
    renewals += other.renewals;
    losses += other.losses;
    resets += other.resets;
    worst = std::max(worst, other.worst);
    out += other.out;
  }
  void print(const std::string& what) const {
    std::printf("%-8s %7d %8d %6d %6d %12.3f %% %9.1f s %10.3f ms %5d\n", what.c_str(), checks, renewals,
                losses, resets, 100 * (1 - unlocked / seconds), unlocked, worst, out);
    std::fflush(stdout);
  }
};

/// Holds the rig for an hour or less. The truth is asked every second, and about every round.
bool hold_hour(rig::Alignment& alignment, const test::SmallBench& bench, double seconds, Held& held) {
  Clock& clock = *bench.align.clock;
  const int resets = alignment.resets();
  const TimePoint began = clock.now();
  const auto look = [&] {
    if (!alignment.locked(clock.now())) return;
    const double error = in_milliseconds(bench.true_error(SecondsPerRow(1)).value() * Seconds(1));
    held.worst = std::max(held.worst, error);
    held.out += error > in_milliseconds(kTolerance) ? 1 : 0;
  };
  while (clock.now() - began < Seconds(seconds)) {
    const TimePoint next = clock.now() + alignment.next_check(clock.now());
    while (clock.now() < next) {
      const TimePoint until = std::min(next, clock.now() + Seconds(1));
      if (!alignment.locked(until)) held.unlocked += (until - clock.now()).value();
      alignment.wait(until);
      look();
    }
    const TimePoint round = clock.now();
    const bool locked = alignment.locked(round + alignment.options().round_time);
    const bool renewed = alignment.last().renews;
    if (const Status filmed = alignment.round(); !filmed.ok()) {
      std::printf("%s\n", filmed.error().message().c_str());
      return false;
    }
    if (!locked) held.unlocked += (clock.now() - round).value();
    held.checks += locked ? 1 : 0;
    const bool holds = alignment.locked(clock.now());
    if (!renewed && alignment.last().renews) ++held.renewals;
    if ((locked || renewed) && !holds && !alignment.last().renews) {
      ++held.losses;
      std::printf("         lock given up at %.1f s: %s\n", (clock.now() - TimePoint{}).value(),
                  alignment.words().reason.c_str());
    }
    look();
  }
  held.seconds = (clock.now() - began).value();
  held.resets = alignment.resets() - resets;
  return true;
}

int hold(double hours) {
  test::SmallBench bench = bench_of(1, smear::AlignPolicy::timed, kWander);
  const auto made = rig::Alignment::create(bench.align, bench.options);
  if (!made || !(*made)->start()) return 1;
  std::printf("%-8s %7s %8s %6s %6s %14s %11s %13s %5s\n", "hour", "checks", "renewals", "losses", "resets",
              "locked", "not locked", "worst error", "out");
  Held all;
  for (int hour = 0; hour < hours; ++hour) {
    Held held;
    if (!hold_hour(**made, bench, 3600 * std::min(1.0, hours - hour), held)) return 1;
    held.print(std::to_string(hour + 1));
    all.add(held);
  }
  all.print("all");
  std::printf("%g h of rig time, crystals that wander by %g ppm RMS in an hour, tolerance %.1f ms: %s\n",
              hours, kWander.value(), in_milliseconds(kTolerance),
              all.out == 0 ? "never out unnoticed" : "OUT UNNOTICED");
  return all.out == 0 ? 0 : 1;
}

}  // namespace
}  // namespace emberlock

int main(int count, char** arguments) {
  const std::string what = count > 1 ? arguments[1] : "cold";
  const double much = count > 2 ? std::atof(arguments[2]) : (what == "hold" ? 24 : 100);
  return what == "hold" ? emberlock::hold(much) : emberlock::cold(static_cast<int>(much));
}
