// SPDX-License-Identifier: Apache-2.0
// Scenes that are hard on solvers, for every device of this machine and both solvers.
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/results.h"
#include "tests/support/ring_scene.h"

namespace emberlock::recon {
namespace {

constexpr double kFullCircle = 2 * std::numbers::pi;

/// Scenes are rendered once for all tests.
const Scene& scene_of(int views, double extinction = 32.8, double arc = kFullCircle, int width = 48) {
  static std::map<std::tuple<int, double, double, int>, Scene> scenes;
  const auto [at, first] = scenes.try_emplace({views, extinction, arc, width});
  if (first) {
    RingOptions ring;
    ring.views = views;
    ring.extinction = PerMeter(extinction);
    ring.arc = arc;
    ring.image = {width, width * 3 / 4};
    at->second = ring_scene(ring);
  }
  return at->second;
}

class HardScene : public testing::TestWithParam<std::tuple<Device, Solver>> {
 protected:
  [[nodiscard]] static SolveOptions options(int iterations = 30) {
    SolveOptions o;
    o.compute.device = std::get<Device>(GetParam());
    o.solver = std::get<Solver>(GetParam());
    o.iterations = iterations;
    return o;
  }
  static Result<Reconstruction> solve_on(const Scene& scene, int voxels, double extinction = 32.8,
                                         int iterations = 30) {
    return solve(scene, grid_over(scene.box, voxels), absorbing(PerMeter(extinction)), options(iterations));
  }
  /// Finite, not negative (the paper's solver has no such bound), and the pictures' error ends at most 5 %
  /// above its best.
  static void expect_stable(const Result<Reconstruction>& r) {
    ASSERT_TRUE(r.ok()) << r.error().message();
    const bool bounded = std::get<Solver>(GetParam()) == Solver::standard;
    for (const float v : r->volume.emission) ASSERT_TRUE(std::isfinite(v) && (v >= 0 || !bounded)) << v;
    ASSERT_FALSE(r->trace.empty());
    double least = all_channels(r->trace.front().input_rmse);
    for (const TracePoint& p : r->trace) least = std::min(least, all_channels(p.input_rmse));
    EXPECT_LE(all_channels(r->trace.back().input_rmse), 1.05 * least + 1e-4);
  }
};
using HardSceneSlow = HardScene;

TEST_P(HardSceneSlow, NeitherFewViewsNorThickMediaDiverge) {
  const double edge = 0.2 / 16;
  for (const int views : {4, 10, 28})
    for (const double tau : {0.01, 0.05, 0.2, 0.5}) {
      SCOPED_TRACE(std::to_string(views) + " views, opacity " + std::to_string(tau));
      const double extinction = extinction_of_opacity(tau, Meters(edge)).value();
      expect_stable(solve_on(scene_of(views, extinction), 16, extinction, 40));
    }
}

TEST_P(HardSceneSlow, PixelsAsWideAsTheVoxelsDoNotDiverge) {
  for (const int width : {24, 48, 84, 96}) {  // 0.6 to 2.3 pixels a voxel
    SCOPED_TRACE(width);
    expect_stable(solve_on(scene_of(10, 0, kFullCircle, width), 24, 0));
  }
}

TEST_P(HardScene, OneView) { expect_stable(solve_on(scene_of(1), 16)); }
TEST_P(HardScene, TwoOppositeViews) { expect_stable(solve_on(scene_of(2), 16)); }
TEST_P(HardScene, TenViewsWithinTenDegrees) {
  expect_stable(solve_on(scene_of(10, 32.8, std::numbers::pi / 18), 16));
}

TEST_P(HardSceneSlow, ExtinctionFromNearlyNoneToAMillionAMetre) {
  for (const double extinction : {1e-6, 400.0, 1e3, 1e6}) {
    SCOPED_TRACE(extinction);
    expect_stable(solve_on(scene_of(10), 16, extinction));
  }
}

TEST_P(HardScene, SaturatedViews) {
  Scene scene = scene_of(10);
  for (View& view : scene.views)
    edit(view.image, [](RadianceImage& image) {
      for (float& v : image.rgb) v = std::min(255.F, 20 * v);
    });
  expect_stable(solve_on(scene, 16));
}

TEST_P(HardScene, OneVoxelOneRowAndOneColumnOfVoxels) {
  Scene scene = scene_of(10);
  for (const Eigen::Vector3d& size : {Eigen::Vector3d(0.02, 0.02, 0.02), Eigen::Vector3d(0.02, 0.14, 0.02),
                                      Eigen::Vector3d(0.02, 0.02, 0.14)}) {
    scene.box.size = size;
    SCOPED_TRACE(size.transpose());
    const auto r = solve_on(scene, size.maxCoeff() > 0.1 ? 7 : 1);
    expect_stable(r);
    EXPECT_GT(*std::max_element(r->volume.emission.begin(), r->volume.emission.end()), 0);
  }
}

TEST_P(HardSceneSlow, TenThousandIterationsNeitherDriftNorDiverge) {
  RingOptions ring;
  ring.views = 4;
  ring.image = {16, 12};
  static const Scene scene = ring_scene(ring);
  const auto r = value_of(solve_on(scene, 6, 32.8, 10000));
  ASSERT_EQ(r.iterations, 10000);
  for (const float v : r.volume.emission) ASSERT_TRUE(std::isfinite(v));
  const auto error = [&](std::size_t i) { return all_channels(r.trace[i].input_rmse); };
  for (std::size_t i = 5000; i < 10000; ++i) ASSERT_LE(error(i), error(4999) + 0.01) << i;
  EXPECT_LT(error(9999), 0.7 * error(0));
}

TEST_P(HardScene, AThresholdAboveEverythingIsAnErrorThatNamesAView) {
  SolveOptions o = options();
  o.flame_threshold = 1000;
  const Scene& scene = scene_of(10);
  const Error r = solve(scene, grid_over(scene.box, 16), {}, o).error();
  EXPECT_EQ(r.kind, ErrorKind::bad_input);
  EXPECT_EQ(r.where, "camera 0");
}

TEST_P(HardScene, ABlackViewIsAnErrorThatNamesIt) {
  Scene scene = scene_of(10);
  scene.views[3].image = share(RadianceImage(scene.views[3].image->size));
  EXPECT_EQ(solve_on(scene, 16).error().where, "camera 3");
}

TEST_P(HardScene, NanAndInfiniteInputIsAnErrorThatNamesItsView) {
  const auto refused = [](const std::function<void(View&)>& spoil) {
    Scene scene = scene_of(10);
    spoil(scene.views[4]);
    const auto r = solve_on(scene, 16);
    return !r.ok() && r.error().kind == ErrorKind::bad_input && r.error().where == "camera 4";
  };
  const float nan = std::nanf("");
  const auto with_nan = [&](RadianceImage& image) { image.rgb[100] = nan; };
  EXPECT_TRUE(refused([&](View& v) { edit(v.image, with_nan); }));
  EXPECT_TRUE(
      refused([](View& v) { edit(v.image, [](RadianceImage& image) { image.rgb.back() = -INFINITY; }); }));
  EXPECT_TRUE(refused([&](View& v) {
    v.background = v.image;
    edit(v.background, with_nan);
  }));
  EXPECT_TRUE(refused([](View& v) { v.image.reset(); })) << "no picture at all";
  EXPECT_TRUE(refused([](View& v) { v.background = share(RadianceImage({8, 6})); })) << "of another size";
  EXPECT_TRUE(refused([](View& v) { v.average = share(RadianceImage({8, 6})); })) << "of another size";
  EXPECT_TRUE(refused([](View& v) { v.camera.camera_from_world.translation.x() = INFINITY; }));
  EXPECT_TRUE(refused([](View& v) { v.camera.camera_from_world.rotation(2, 2) = NAN; }));
  EXPECT_TRUE(refused([](View& v) { v.camera.intrinsics.fy = NAN; }));
  EXPECT_TRUE(refused([](View& v) { v.camera.intrinsics.distortion.k2 = INFINITY; }));
}

std::string name_of_case(const testing::TestParamInfo<HardScene::ParamType>& p) {
  return device_name(std::get<Device>(p.param)) +
         (std::get<Solver>(p.param) == Solver::paper ? "_paper" : "_default");
}
const auto kHardCases =
    testing::Combine(testing::ValuesIn(devices()), testing::Values(Solver::standard, Solver::paper));
INSTANTIATE_TEST_SUITE_P(Devices, HardScene, kHardCases, name_of_case);
INSTANTIATE_TEST_SUITE_P(Devices, HardSceneSlow, kHardCases, name_of_case);

}  // namespace
}  // namespace emberlock::recon
