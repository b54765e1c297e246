#include "recon/adjust/solver.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/render/render.h"
#include "tests/support/small_flame.h"

namespace emberlock {
namespace {

const Effects kPaperMedium = absorbing(PerMeter(32.8));

SolveOptions on_cpu(int iterations = 0) {
  SolveOptions options;
  options.compute.device = Device::cpu;
  options.iterations = iterations;
  return options;
}

bool finite(const Reconstruction& r) {
  for (const float v : r.volume.emission)
    if (!std::isfinite(v)) return false;
  return true;
}

TEST(Solver, DefaultBeatsThePapersByFarOnTheHeldOutView) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 48);
  const auto standard = solve(scene, grid, kPaperMedium, on_cpu());
  SolveOptions options = on_cpu(30);
  options.solver = Solver::paper;
  const auto paper = solve(scene, grid, kPaperMedium, options);
  ASSERT_TRUE(standard.ok() && paper.ok());
  EXPECT_LT(all_channels(standard->trace.back().heldout_rmse), 6);
  EXPECT_LT(all_channels(standard->trace.back().heldout_rmse),
            0.5 * all_channels(paper->trace.back().heldout_rmse));
  for (const float v : standard->volume.emission) ASSERT_GE(v, 0);
}

TEST(Solver, PapersErrorFallsMonotonically) {
  SolveOptions options = on_cpu(25);
  options.solver = Solver::paper;
  const Scene scene = small_flame_scene();
  const auto r = solve(scene, grid_over(scene.box, 48), kPaperMedium, options);
  ASSERT_TRUE(r.ok());
  for (std::size_t i = 1; i < r->trace.size(); ++i)
    EXPECT_LT(all_channels(r->trace[i].input_rmse), all_channels(r->trace[i - 1].input_rmse));
}

TEST(Solver, SameBitsForOneTwoAndSixteenThreads) {
  const Scene scene = small_flame_scene();
  for (const Solver solver : {Solver::standard, Solver::paper}) {
    std::vector<std::vector<float>> volumes;
    for (const int threads : {1, 2, 16}) {
      SolveOptions options = on_cpu(3);
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

TEST(Solver, TracedErrorsAreThoseOfTheRenderedVolume) {
  const Scene scene = small_flame_scene();
  const auto r = solve(scene, grid_over(scene.box, 40), kPaperMedium, on_cpu());
  ASSERT_TRUE(r.ok());
  const View& test = scene.views[10];
  const RadianceImage image = render_view(r->volume, r->hull, r->effects, test.camera);
  const PixelBox box = flame_mask(test.image, noise_threshold(test.image)).box;
  EXPECT_NEAR(all_channels(rmse(image, test.image, box)), all_channels(r->trace.back().heldout_rmse), 1e-2);
}

TEST(Solver, FewOrBadlyPlacedViewsStillFitWhatTheySee) {
  const Scene all = small_flame_scene();
  for (const std::vector<std::size_t>& chosen :
       {std::vector<std::size_t>{0}, std::vector<std::size_t>{0, 5}}) {
    Scene scene{{}, all.box};
    for (const std::size_t v : chosen) scene.views.push_back(all.views[v]);
    const auto r = solve(scene, grid_over(scene.box, 32), kPaperMedium, on_cpu());
    ASSERT_TRUE(r.ok());
    EXPECT_TRUE(finite(*r));
    EXPECT_LT(all_channels(r->trace.back().input_rmse), 12);
  }
}

TEST(Solver, TenViewsWithinTenDegreesStayStable) {
  const FlameTruth truth =
      Flame().at(Seconds(0), grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 48));
  Scene scene{{}, {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}};
  for (int i = 0; i < 10; ++i) {
    const double a = i * 0.0175;
    View view{"camera " + std::to_string(i),
              look_at({{120, 90}, 104, 104, 60, 45, {}}, {0.3 * std::cos(a), 0.3 * std::sin(a), 0},
                      Eigen::Vector3d::Zero()),
              {}};
    view.image = render_view(truth.volume, truth.medium, truth.effects, view.camera);
    scene.views.push_back(view);
  }
  const auto r = solve(scene, grid_over(scene.box, 32), kPaperMedium, on_cpu(20));
  ASSERT_TRUE(r.ok());
  EXPECT_TRUE(finite(*r));
  EXPECT_LT(all_channels(r->trace.back().input_rmse), 12);
}

TEST(Solver, OneVoxelAndOneColumnOfVoxels) {
  Scene scene = small_flame_scene();
  for (const Eigen::Vector3d& size : {Eigen::Vector3d(0.02, 0.02, 0.02), Eigen::Vector3d(0.02, 0.02, 0.14),
                                      Eigen::Vector3d(0.02, 0.14, 0.02)}) {
    scene.box.size = size;
    const auto r = solve(scene, grid_over(scene.box, size.maxCoeff() > 0.1 ? 7 : 1), kPaperMedium, on_cpu(5));
    ASSERT_TRUE(r.ok()) << r.error().message();
    EXPECT_TRUE(finite(*r));
    EXPECT_GT(*std::max_element(r->volume.emission.begin(), r->volume.emission.end()), 0);
  }
}

TEST(Solver, ThickMediaAndExtremeExtinctionStayStable) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  for (const double depth : {0.05, 0.2, 0.5, 1.0, 5.0, 1e4}) {  // a voxel edge
    const Effects thick = absorbing(PerMeter(depth / static_cast<double>(grid.edge)));
    const auto r = solve(scene, grid, thick, on_cpu(30));
    ASSERT_TRUE(r.ok());
    EXPECT_TRUE(finite(*r)) << depth;
    EXPECT_LE(all_channels(r->trace.back().input_rmse), 1.05 * all_channels(r->trace.front().input_rmse))
        << depth;
    EXPECT_LT(all_channels(r->trace.back().input_rmse), 80) << depth;
  }
}

TEST(Solver, ThousandsOfIterationsDoNotDiverge) {
  PaperSceneOptions options;
  options.image = {40, 30};
  options.truth_voxels = 24;
  const Scene scene = paper_scene(options);
  const auto r = solve(scene, grid_over(scene.box, 12), kPaperMedium, on_cpu(2500));
  ASSERT_TRUE(r.ok());
  EXPECT_EQ(r->iterations, 2500);
  EXPECT_TRUE(finite(*r));
  EXPECT_LE(all_channels(r->trace.back().input_rmse), all_channels(r->trace[20].input_rmse) * 1.01);
}

TEST(Solver, SaturatedViewsAreFittedAsTheyAre) {
  Scene scene = small_flame_scene();
  for (View& view : scene.views)
    for (float& v : view.image.rgb) v = std::min(255.F, 4 * v);
  const auto r = solve(scene, grid_over(scene.box, 32), kPaperMedium, on_cpu());
  ASSERT_TRUE(r.ok());
  EXPECT_TRUE(finite(*r));
}

TEST(Solver, StopsAtTheTargetAndAtTheBudget) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  SolveOptions options = on_cpu(50);
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

TEST(Solver, TargetWithoutHeldOutViewIsRefused) {
  Scene scene = small_flame_scene();
  scene.views.pop_back();
  SolveOptions options = on_cpu();
  options.target_rmse = 3;
  EXPECT_EQ(solve(scene, grid_over(scene.box, 16), {}, options).error().where, "target-rmse");
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

TEST(Device, CudaAgreesWithTheCpuWhereAGpuIsThere) {
  const Scene scene = small_flame_scene();
  SolveOptions options = on_cpu(3);
  const auto cpu = solve(scene, grid_over(scene.box, 40), kPaperMedium, options);
  options.compute.device = Device::cuda;
  const auto cuda = solve(scene, grid_over(scene.box, 40), kPaperMedium, options);
  ASSERT_TRUE(cpu.ok());
  if (!resolve(Device::cuda).ok()) {
    EXPECT_EQ(cuda.error().kind, ErrorKind::device);
    return;
  }
  ASSERT_TRUE(cuda.ok());
  EXPECT_NEAR(all_channels(cuda->trace.back().heldout_rmse), all_channels(cpu->trace.back().heldout_rmse),
              0.01);
}

}  // namespace
}  // namespace emberlock
