// How long one virtual camera takes to draw one frame, by the passes that its scene lists.
#include "drivers/virtual/virtual_rig.h"

#include <memory>
#include <vector>

#include <benchmark/benchmark.h>

#include "drivers/virtual/virtual_clock.h"

namespace emberlock {
namespace {

void draw_frames(benchmark::State& state, const std::vector<Pass>& passes, StrobeOutput output,
                 double flashes) {
  VirtualRigOptions options = draw_virtual_rig({.cameras = 1});
  options.scene.passes = passes;
  const auto rig = VirtualRig::create(options, std::make_shared<VirtualClock>()).value();
  if (!rig->strobe().apply({.output = output, .rate = Hertz(flashes)}).ok() || !rig->camera(0).start().ok()) {
    state.SkipWithError("the rig does not start");
    return;
  }
  for (auto _ : state) benchmark::DoNotOptimize(rig->camera(0).next_frame(Seconds(1)).value());
}

const std::vector<Pass> kLight = {Pass::lamp, Pass::bloom, Pass::smear, Pass::hot_pixels};
const std::vector<Pass> kAll = {Pass::lamp,       Pass::bloom,      Pass::smear,   Pass::hot_pixels,
                                Pass::shot_noise, Pass::read_noise, Pass::quantise};

BENCHMARK_CAPTURE(draw_frames, no_pass, std::vector<Pass>{}, StrobeOutput::flashing, 24)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, light_alone, kLight, StrobeOutput::flashing, 24)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, one_dot, kAll, StrobeOutput::flashing, 24)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, comb, kAll, StrobeOutput::flashing, 300)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(draw_frames, steady, kAll, StrobeOutput::steady, 24)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace emberlock

BENCHMARK_MAIN();
