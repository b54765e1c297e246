// SPDX-License-Identifier: Apache-2.0
// How long one virtual camera takes to draw one frame, by the passes that its scene lists.
#include "drivers/virtual/virtual_rig.h"

#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "drivers/virtual/virtual_clock.h"

namespace emberlock {
namespace {

void draw_frames(benchmark::State& state, const std::vector<drivers::Pass>& passes,
                 drivers::StrobeOutput output, double flashes) {
  drivers::VirtualRigOptions options = drivers::draw_virtual_rig({.cameras = 1});
  options.scene.passes = passes;
  const auto rig = drivers::VirtualRig::create(options, std::make_shared<drivers::VirtualClock>()).value();
  if (!rig->strobe().apply({.output = output, .rate = Hertz(flashes)}).ok() || !rig->camera(0).start().ok()) {
    state.SkipWithError("the rig does not start");
    return;
  }
  for (auto _ : state) benchmark::DoNotOptimize(rig->camera(0).next_frame(Seconds(1)).value());
}

const std::vector<drivers::Pass> kLight = {drivers::Pass::lamp, drivers::Pass::bloom, drivers::Pass::smear,
                                           drivers::Pass::hot_pixels};
const std::vector<drivers::Pass> kAll = {
    drivers::Pass::lamp,       drivers::Pass::bloom,      drivers::Pass::smear,   drivers::Pass::hot_pixels,
    drivers::Pass::shot_noise, drivers::Pass::read_noise, drivers::Pass::quantise};

BENCHMARK_CAPTURE(draw_frames, no_pass, std::vector<drivers::Pass>{}, drivers::StrobeOutput::flashing, 24)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, light_alone, kLight, drivers::StrobeOutput::flashing, 24)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, one_dot, kAll, drivers::StrobeOutput::flashing, 24)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, comb, kAll, drivers::StrobeOutput::flashing, 300)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, steady, kAll, drivers::StrobeOutput::steady, 24)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace emberlock

BENCHMARK_MAIN();
