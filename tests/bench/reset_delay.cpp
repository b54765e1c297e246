// SPDX-License-Identifier: Apache-2.0
// What the smear (the bands of rolling shutters, the brightness of global ones) tells of shutter resets: the
// delay from the order to the new phase's stamps, modulo T, and how it jitters, beside the virtual cameras'
// truth.
//   bench_reset_delay [RIGS]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "tests/support/small_rig.h"

namespace {

using namespace emberlock;

struct Delays {
  std::vector<double> learnt_ms;
  std::vector<double> off_ms;  ///< from the truth
};

/// Aligns rigs of three cameras, whose resets differ by their jitter alone.
Delays measure(SensorKind kind, int rigs) {
  Delays delays;
  for (int seed = 1; seed <= rigs; ++seed) {
    drivers::VirtualRigOptions setup =
        test::small_rig(static_cast<std::uint64_t>(seed), 3, {kind, kind, kind});
    for (drivers::VirtualCameraOptions& camera : setup.cameras) camera.reset_latency = milliseconds(180);
    test::SmallBench bench(setup);
    bench.options.align.policy = smear::AlignPolicy::timed;
    bench.options.align.tolerance.amount = Rows(10);
    const auto result = rig::run_align(bench.align, bench.options);
    if (!result.ok()) {
      std::fprintf(stderr, "rig %d: %s\n", seed, result.error().message().c_str());
      continue;
    }
    for (int i = 0; i < bench.rig->size(); ++i) {
      if (!result->delays[i]) continue;
      const smear::CcdTiming& timing = bench.rig->truth(i).timing;
      // A frame is stamped when its last row has been shifted out.
      const Seconds truth = milliseconds(180) + Rows(timing.shifts) * timing.row_time;
      delays.learnt_ms.push_back(in_milliseconds(result->delays[i]->mean));
      delays.off_ms.push_back(
          in_milliseconds(wrap_symmetric(result->delays[i]->mean - truth, timing.frame_period)));
    }
  }
  return delays;
}

void print(SensorKind kind, const Delays& delays) {
  const auto n = static_cast<double>(delays.off_ms.size());
  double mean = 0;
  double learnt = 0;
  for (std::size_t i = 0; i < delays.off_ms.size(); ++i) {
    mean += delays.off_ms[i] / n;
    learnt += delays.learnt_ms[i] / n;
  }
  double squares = 0;
  for (const double off : delays.off_ms) squares += (off - mean) * (off - mean);
  std::printf("%-8s %6.0f %12.3f %16.3f %14.3f\n", std::string(name(kind)).c_str(), n, learnt, mean,
              std::sqrt(squares / (n - 1)));
}

}  // namespace

int main(int argc, char** argv) {
  const int rigs = argc > 1 ? std::max(2, std::atoi(argv[1])) : 20;
  std::printf("virtual cameras, 320 x 240 at 23.976/s, resets jitter by 0.2 ms in truth; %d rigs of three\n",
              rigs);
  std::printf("%-8s %6s %12s %16s %14s\n", "sensor", "taught", "delay, ms", "off the truth", "jitter, ms");
  for (const SensorKind kind : {SensorKind::ccd, SensorKind::rolling_shutter, SensorKind::global_shutter}) {
    print(kind, measure(kind, rigs));
  }
}
