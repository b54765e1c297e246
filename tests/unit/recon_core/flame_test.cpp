// SPDX-License-Identifier: Apache-2.0
#include "recon/synthetic/flame.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/key_points.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

const Grid kGrid = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 40);

TEST(Flame, IsDeterministicBySeed) {
  FlameOptions other;
  other.seed = 2;
  const FlameTruth a = Flame().at(Seconds(0.1), kGrid);
  EXPECT_EQ(a.volume.emission, Flame().at(Seconds(0.1), kGrid).volume.emission);
  EXPECT_NE(a.volume.emission, Flame(other).at(Seconds(0.1), kGrid).volume.emission);
}

TEST(Flame, EmitsOnlyInsideItsMediumAndClearOfTheBox) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    FlameOptions options;
    options.shape = shape;
    const FlameTruth truth = Flame(options).at(Seconds(0), kGrid);
    EXPECT_GT(truth.medium.count, 300u);
    each_point(kGrid, [&](int i, int j, int k, std::size_t p) {
      if (truth.volume.emission[3 * p] <= 0) return;
      ASSERT_TRUE(i > 0 && j > 0 && k > 0 && i < kGrid.nx - 1 && j < kGrid.ny - 1 && k < kGrid.nz - 1);
      const int voxel = i + (kGrid.nx - 1) * (j + (kGrid.ny - 1) * k);
      ASSERT_EQ(truth.medium.inside[static_cast<std::size_t>(voxel)], 1);
    });
  }
}

TEST(Flame, ChangesSmoothlyAsItRises) {
  const Flame flame;
  const auto difference = [&](double dt) {
    const FlameTruth a = flame.at(Seconds(0.5), kGrid);
    const FlameTruth b = flame.at(Seconds(0.5 + dt), kGrid);
    double sum = 0;
    for (std::size_t i = 0; i < a.volume.emission.size(); ++i)
      sum += std::abs(static_cast<double>(a.volume.emission[i] - b.volume.emission[i]));
    return sum;
  };
  const double short_time = difference(0.0005);
  EXPECT_GT(short_time, 0);
  EXPECT_LT(short_time, 0.5 * difference(0.005));
}

TEST(PaperScene, IsTheTenPlusOneViewsOfThePaper) {
  const Scene scene = paper_scene(small_film({64, 48}, 32));
  ASSERT_EQ(scene.views.size(), 11u);
  EXPECT_EQ(std::ranges::count(scene.views, ViewRole::held_out, &View::role), 1);
  for (const View& view : scene.views) {
    EXPECT_NEAR(view.camera.center().norm(), 0.3, 1e-9);
    const float brightest = *std::max_element(view.image->rgb.begin(), view.image->rgb.end());
    EXPECT_GT(brightest, 120);
    EXPECT_LT(brightest, 256);
  }
}

TEST(PaperScene, AnyNumberOfCamerasStandsEvenlyAroundTheSameHeldOutView) {
  PaperSceneOptions options = small_film({32, 24}, 16);
  const Scene ten = paper_scene(options);
  for (const int cameras : {3, 4, 7, 16}) {
    options.cameras = cameras;
    const Scene scene = paper_scene(options);
    ASSERT_EQ(scene.views.size(), static_cast<std::size_t>(cameras) + 1);
    EXPECT_EQ(scene.views.back().image->rgb, ten.views.back().image->rgb);
    const auto azimuth = [&](int i) {
      const Eigen::Vector3d c = scene.views[static_cast<std::size_t>(i)].camera.center();
      return std::atan2(c.y(), c.x());
    };
    for (int i = 0; i < cameras; ++i) {
      const double step = std::remainder(azimuth((i + 1) % cameras) - azimuth(i), 2 * M_PI);
      EXPECT_NEAR(step, 2 * M_PI / cameras, 1e-9);
      EXPECT_GT(std::abs(std::remainder(azimuth(i) - M_PI / 2, 2 * M_PI)), 0.4 * step) << "beside the judge";
    }
  }
}

TEST(PaperScene, AnExposureIsTheMeanOfItsInstants) {
  PaperSceneOptions options = small_film({32, 24}, 16);
  const auto at = [&](double ms) {
    PaperSceneOptions o = options;
    o.time = milliseconds(ms);
    return paper_scene(o).views[0].image->rgb;
  };
  options.flame.rise_speed = 1;
  options.exposure = milliseconds(25);  // two voxels of 12.5 mm
  const std::vector<float> exposed = paper_scene(options).views[0].image->rgb;
  options.exposure = Seconds(0);
  const std::vector<float> before = at(-6.25);
  const std::vector<float> after = at(6.25);
  for (std::size_t i = 0; i < exposed.size(); ++i)
    ASSERT_NEAR(exposed[i], 0.5F * (before[i] + after[i]), 1e-3);
}

}  // namespace
}  // namespace emberlock::recon
