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
#include "tests/support/solves.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(SolverTest);
ON_EACH_DEVICE(WatchedSolverThreads);

class BesideTheCpu : public OnEachDevice {};
INSTANTIATE_TEST_SUITE_P(Devices, BesideTheCpu, testing::ValuesIn(others_of(devices())),
                         [](const auto& on) { return device_name(on.param); });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(BesideTheCpu);  // where there is no GPU

const Effects kPaperMedium = absorbing(PerMeter(32.8));

/// Whether the input error of each iteration is at most that of the one before.
void expect_falling(const Reconstruction& r) {
  for (std::size_t i = 1; i < r.trace.size(); ++i)
    EXPECT_LE(all_channels(r.trace[i].input_rmse), all_channels(r.trace[i - 1].input_rmse)) << i;
}

TEST_P(SolverTest, DefaultBeatsThePapersByFarOnTheHeldOutView) {
  const Scene scene = small_flame_scene();
  const Reconstruction standard = solved_on(scene, 48, kPaperMedium);
  const Reconstruction paper = solved_on(scene, 48, kPaperMedium, solve_options(30, Solver::paper));
  EXPECT_LT(held_out_error(standard), 6);
  EXPECT_LT(held_out_error(standard), 0.5 * held_out_error(paper));
  for (const float v : standard.volume.emission) ASSERT_GE(v, 0);
}

/// Of few pixels and with an extinction that is partly soot's: steps of both that overshoot let the error
/// rise threefold before it falls again.
TEST_P(SolverTest, EmissionAndExtinctionTogetherFitBetterWithEveryIteration) {
  PaperSceneOptions film = small_film({160, 120}, 48);
  film.flame.seed = 4;
  const Scene scene = paper_scene(film);
  Effects effects;
  effects.extinction = {Extinction::Model::field, PerMeter(9.7), PerMeter(13.8)};
  expect_falling(solved_on(scene, 48, effects, solve_options(8)));
}

TEST_P(SolverTest, PapersErrorFallsMonotonically) {
  const Reconstruction r = solved_on(small_flame_scene(), 48, kPaperMedium, solve_options(25, Solver::paper));
  for (std::size_t i = 1; i < r.trace.size(); ++i)
    EXPECT_LT(all_channels(r.trace[i].input_rmse), all_channels(r.trace[i - 1].input_rmse));
}

TEST_P(SolverTest, SameBitsForOneTwoAndSixteenThreads) {
  const Scene scene = small_flame_scene();
  for (const Solver solver : {Solver::standard, Solver::paper}) {
    std::vector<std::vector<float>> volumes;
    for (const int threads : {1, 2, 16}) {
      SolveOptions options = solve_options(3, solver);
      options.compute.threads = threads;
      volumes.push_back(solved_on(scene, 48, kPaperMedium, options).volume.emission);
    }
    EXPECT_EQ(volumes[0], volumes[1]);
    EXPECT_EQ(volumes[0], volumes[2]);
  }
}

TEST_P(SolverTest, TracedErrorsAreThoseOfTheRenderedVolume) {
  const Scene scene = small_flame_scene();
  const Reconstruction r = solved_on(scene, 40, kPaperMedium);
  const View& test = scene.views[10];
  const RadianceImage image = render_view(r.volume, r.hull, r.effects, test.camera);
  const PixelBox box = flame_mask(*test.image, noise_threshold(*test.image)).box;
  EXPECT_NEAR(all_channels(rmse(image, *test.image, box)), held_out_error(r), 1e-2);
}

TEST_P(SolverTest, FewOrBadlyPlacedViewsStillFitWhatTheySee) {
  const Scene all = small_flame_scene();
  for (const std::vector<std::size_t>& chosen :
       {std::vector<std::size_t>{0}, std::vector<std::size_t>{0, 5}}) {
    Scene scene{{}, all.box};
    for (const std::size_t v : chosen) scene.views.push_back(all.views[v]);
    const Reconstruction r = solved_on(scene, 32, kPaperMedium);
    for (const float v : r.volume.emission) ASSERT_TRUE(std::isfinite(v));
    EXPECT_LT(input_error(r), 12);
  }
}

TEST_P(SolverTest, StopsAtTheTargetAndAtTheBudget) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  SolveOptions options = solve_options(50);
  options.target_rmse = 30;
  EXPECT_EQ(value_of(solve(scene, grid, kPaperMedium, options)).iterations, 1);
  options.target_rmse.reset();
  options.budget = Seconds(20);
  double clock = 0;  // every look at the clock costs a second
  const auto timed = value_of(solve(scene, grid, kPaperMedium, options, [&] { return Seconds(clock++); }));
  EXPECT_LT(timed.iterations, 20);
  EXPECT_FALSE(solve(scene, grid, kPaperMedium, options).ok()) << "a budget needs a clock";
}

TEST_P(SolverTest, TargetWithoutHeldOutViewIsRefused) {
  Scene scene = small_flame_scene();
  scene.views.pop_back();
  SolveOptions options;
  options.target_rmse = 3;
  EXPECT_EQ(solve(scene, grid_over(scene.box, 16), {}, options).error().where, "target-rmse");
}

TEST_P(BesideTheCpu, ReconstructsWhatTheCpuDoes) {
  const Scene scene = small_flame_scene();
  SolveOptions options = solve_options(3);
  const Reconstruction here = solved_on(scene, 40, kPaperMedium, options);
  options.compute.device = Device::cpu;
  const Reconstruction cpu = solved_on(scene, 40, kPaperMedium, options);
  EXPECT_EQ(here.hull.inside, cpu.hull.inside);
  EXPECT_NEAR(held_out_error(here), held_out_error(cpu), 0.01);
}

TEST_P(WatchedSolverThreads, WhoWatchesSeesAnEarlierVolumeAndChangesNothing) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  const Reconstruction alone = solved_on(scene, 32, kPaperMedium, solve_options(6));
  std::vector<std::vector<float>> states;
  std::vector<std::vector<float>> seen;
  const auto watched =
      value_of(solve(scene, grid, kPaperMedium, solve_options(6), {}, [&](const Preview& state) {
        if (const auto recent = state.recent()) seen.push_back(recent->emission);
        states.push_back(state.volume().emission);
      }));
  EXPECT_EQ(watched.volume.emission, alone.volume.emission);
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
  EXPECT_EQ(resolve(Device(Device::cuda, 1000)).error().kind, ErrorKind::device);
}

}  // namespace
}  // namespace emberlock::recon
