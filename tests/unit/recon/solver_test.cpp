// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/solver.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/compute/pool.h"
#include "recon/render/render.h"
#include "tests/support/devices.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(SolverTest);
ON_EACH_DEVICE(WatchedSolverThreads);

class BesideTheCpu : public OnEachDevice {};
INSTANTIATE_TEST_SUITE_P(Devices, BesideTheCpu, testing::ValuesIn(others_of(devices())),
                         [](const auto& on) { return device_name(on.param); });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(BesideTheCpu);  // where there is no GPU

const Effects kPaperMedium = absorbing(PerMeter(32.8));

SolveOptions on_device(int iterations = 0) {
  SolveOptions options;
  options.compute.device = device_here();
  options.iterations = iterations;
  return options;
}

bool finite(const Reconstruction& r) {
  for (const float v : r.volume.emission)
    if (!std::isfinite(v)) return false;
  return true;
}

TEST_P(SolverTest, DefaultBeatsThePapersByFarOnTheHeldOutView) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 48);
  const auto standard = solve(scene, grid, kPaperMedium, on_device());
  SolveOptions options = on_device(30);
  options.solver = Solver::paper;
  const auto paper = solve(scene, grid, kPaperMedium, options);
  ASSERT_TRUE(standard.ok() && paper.ok());
  EXPECT_LT(all_channels(standard->trace.back().heldout_rmse), 6);
  EXPECT_LT(all_channels(standard->trace.back().heldout_rmse),
            0.5 * all_channels(paper->trace.back().heldout_rmse));
  for (const float v : standard->volume.emission) ASSERT_GE(v, 0);
}

/// Of few pixels and with an extinction that is partly soot's: steps of both that overshoot let the error
/// rise threefold before it falls again.
TEST_P(SolverTest, EmissionAndExtinctionTogetherFitBetterWithEveryIteration) {
  PaperSceneOptions film;
  film.flame.seed = 4;
  film.image = {160, 120};
  film.truth_voxels = 48;
  const Scene scene = paper_scene(film);
  Effects effects;
  effects.extinction = {Extinction::Model::field, PerMeter(9.7), PerMeter(13.8)};
  const auto solved = solve(scene, grid_over(scene.box, 48), effects, on_device(8));
  ASSERT_TRUE(solved.ok());
  for (std::size_t i = 1; i < solved->trace.size(); ++i)
    EXPECT_LE(all_channels(solved->trace[i].input_rmse), all_channels(solved->trace[i - 1].input_rmse)) << i;
}

TEST_P(SolverTest, PapersErrorFallsMonotonically) {
  SolveOptions options = on_device(25);
  options.solver = Solver::paper;
  const Scene scene = small_flame_scene();
  const auto r = solve(scene, grid_over(scene.box, 48), kPaperMedium, options);
  ASSERT_TRUE(r.ok());
  for (std::size_t i = 1; i < r->trace.size(); ++i)
    EXPECT_LT(all_channels(r->trace[i].input_rmse), all_channels(r->trace[i - 1].input_rmse));
}

TEST_P(SolverTest, SameBitsForOneTwoAndSixteenThreads) {
  const Scene scene = small_flame_scene();
  for (const Solver solver : {Solver::standard, Solver::paper}) {
    std::vector<std::vector<float>> volumes;
    for (const int threads : {1, 2, 16}) {
      SolveOptions options = on_device(3);
      options.solver = solver;
      options.compute.threads = threads;
      const auto r = solve(scene, grid_over(scene.box, 48), kPaperMedium, options);
      ASSERT_TRUE(r.ok());
      volumes.push_back(r->volume.emission);
    }
    EXPECT_EQ(volumes[0], volumes[1]);
    EXPECT_EQ(volumes[0], volumes[2]);
  }
}

TEST_P(SolverTest, TracedErrorsAreThoseOfTheRenderedVolume) {
  const Scene scene = small_flame_scene();
  const auto r = solve(scene, grid_over(scene.box, 40), kPaperMedium, on_device());
  ASSERT_TRUE(r.ok());
  const View& test = scene.views[10];
  const RadianceImage image = render_view(r->volume, r->hull, r->effects, test.camera);
  const PixelBox box = flame_mask(*test.image, noise_threshold(*test.image)).box;
  EXPECT_NEAR(all_channels(rmse(image, *test.image, box)), all_channels(r->trace.back().heldout_rmse), 1e-2);
}

TEST_P(SolverTest, FewOrBadlyPlacedViewsStillFitWhatTheySee) {
  const Scene all = small_flame_scene();
  for (const std::vector<std::size_t>& chosen :
       {std::vector<std::size_t>{0}, std::vector<std::size_t>{0, 5}}) {
    Scene scene{{}, all.box};
    for (const std::size_t v : chosen) scene.views.push_back(all.views[v]);
    const auto r = solve(scene, grid_over(scene.box, 32), kPaperMedium, on_device());
    ASSERT_TRUE(r.ok());
    EXPECT_TRUE(finite(*r));
    EXPECT_LT(all_channels(r->trace.back().input_rmse), 12);
  }
}

TEST_P(SolverTest, StopsAtTheTargetAndAtTheBudget) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  SolveOptions options = on_device(50);
  options.target_rmse = 30;
  const auto reached = solve(scene, grid, kPaperMedium, options);
  ASSERT_TRUE(reached.ok());
  EXPECT_EQ(reached->iterations, 1);
  options.target_rmse.reset();
  options.budget = Seconds(20);
  double clock = 0;  // every look at the clock costs a second
  const auto timed = solve(scene, grid, kPaperMedium, options, [&] { return Seconds(clock++); });
  ASSERT_TRUE(timed.ok());
  EXPECT_LT(timed->iterations, 20);
  EXPECT_FALSE(solve(scene, grid, kPaperMedium, options).ok()) << "a budget needs a clock";
}

TEST_P(SolverTest, TargetWithoutHeldOutViewIsRefused) {
  Scene scene = small_flame_scene();
  scene.views.pop_back();
  SolveOptions options = on_device();
  options.target_rmse = 3;
  EXPECT_EQ(solve(scene, grid_over(scene.box, 16), {}, options).error().where, "target-rmse");
}

TEST_P(BesideTheCpu, ReconstructsWhatTheCpuDoes) {
  const Scene scene = small_flame_scene();
  SolveOptions options = on_device(3);
  const auto here = solve(scene, grid_over(scene.box, 40), kPaperMedium, options);
  options.compute.device = Device::cpu;
  const auto cpu = solve(scene, grid_over(scene.box, 40), kPaperMedium, options);
  ASSERT_TRUE(here.ok() && cpu.ok());
  EXPECT_EQ(here->hull.inside, cpu->hull.inside);
  EXPECT_NEAR(all_channels(here->trace.back().heldout_rmse), all_channels(cpu->trace.back().heldout_rmse),
              0.01);
}

TEST_P(WatchedSolverThreads, WhoWatchesSeesAnEarlierVolumeAndChangesNothing) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  const auto alone = solve(scene, grid, kPaperMedium, on_device(6));
  std::vector<std::vector<float>> states;
  std::vector<std::vector<float>> seen;
  const auto watched = solve(scene, grid, kPaperMedium, on_device(6), {}, [&](const Preview& state) {
    if (const auto recent = state.recent()) seen.push_back(recent->emission);
    states.push_back(state.volume().emission);
  });
  ASSERT_TRUE(alone.ok() && watched.ok());
  EXPECT_EQ(watched->volume.emission, alone->volume.emission);
  ASSERT_FALSE(seen.empty());
  for (const auto& volume : seen) EXPECT_EQ(std::count(states.begin(), states.end(), volume), 1);
}

TEST(Device, CudaRunsOrSaysWhyNot) {
  const auto device = resolve(Device::cuda);
  if (device.ok()) {
    EXPECT_EQ(*device, Device::cuda);
  } else {
    EXPECT_EQ(device.error().kind, ErrorKind::device);
    EXPECT_FALSE(device.error().what.empty());
    EXPECT_EQ(*resolve(Device::automatic), Device::cpu);
  }
}

TEST(Device, IsNamedByItsKindAndNumber) {
  for (const char* text : {"auto", "cpu", "cuda", "cuda:1", "cuda:12"})
    EXPECT_EQ(name(*parse_device(text)), text);
  EXPECT_EQ(*parse_device("cuda:0"), *parse_device("cuda"));
  EXPECT_EQ(parse_device("cuda:3")->gpu, 3);
  EXPECT_FALSE(*parse_device("cuda:3") == Device(Device::cuda));
  EXPECT_TRUE(*parse_device("cuda:3") == Device::cuda);
  for (const char* text : {"", "gpu", "cuda:", "cuda:-1", "cuda:1x", "cuda: 1", "cuda:99999999999"})
    EXPECT_FALSE(parse_device(text).ok()) << text;
}

TEST(Device, AGpuThatIsNotThereIsAnError) {
  const auto none = resolve(Device(Device::cuda, 1000));
  ASSERT_FALSE(none.ok());
  EXPECT_EQ(none.error().kind, ErrorKind::device);
}

}  // namespace
}  // namespace emberlock::recon
