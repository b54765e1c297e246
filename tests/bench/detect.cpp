// SPDX-License-Identifier: Apache-2.0
// Time of one reading; prints machine and build by Google Benchmark's own header.
#include "smear_sync/detect/detect.h"

#include <benchmark/benchmark.h>

#include "smear_sync/detect/follow.h"
#include "tests/support/smear_frames.h"

namespace emberlock {
namespace {

Image frame(PixelFormat format, int depth, bool comb) {
  test::SmearScene scene(1280, 720);
  scene.disk(640.3, 300.2, 5, 3000);
  if (comb) {
    for (int k = -4; k <= 6; ++k) {
      if (k != 0) scene.disk(640.3, 300.2 + 61 * k + 7, 5, 15);
    }
  } else {
    scene.disk(640.3, 421.2, 5, 15);
  }
  return scene.image({.bit_depth = depth, .format = format});
}

void read(benchmark::State& state, PixelFormat format, int depth, bool comb) {
  const Image image = frame(format, depth, comb);
  for (auto _ : state) benchmark::DoNotOptimize(smear::detect(image.view()));
}

/// The frames after the first, of a camera that films on.
void follow(benchmark::State& state, PixelFormat format, int depth) {
  const Image image = frame(format, depth, false);
  smear::FollowingDetector detector;
  benchmark::DoNotOptimize(detector.read(image.view()));
  for (auto _ : state) benchmark::DoNotOptimize(detector.read(image.view()));
}

BENCHMARK_CAPTURE(read, gray8_dot, PixelFormat::gray8, 8, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read, gray8_comb, PixelFormat::gray8, 8, true)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read, gray12_dot, PixelFormat::gray16, 12, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read, bayer8_dot, PixelFormat::bayer_rggb8, 8, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(read, rgb8_dot, PixelFormat::rgb8, 8, false)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(follow, gray8_dot, PixelFormat::gray8, 8)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(follow, gray12_dot, PixelFormat::gray16, 12)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(follow, bayer8_dot, PixelFormat::bayer_rggb8, 8)->Unit(benchmark::kMicrosecond);
BENCHMARK_CAPTURE(follow, rgb8_dot, PixelFormat::rgb8, 8)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace emberlock

BENCHMARK_MAIN();
