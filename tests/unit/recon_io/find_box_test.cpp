// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/find_box.h"

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "recon/pipeline/grid_choice.h"
#include "tests/support/edit_view.h"
#include "tests/support/key_points.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

/// Where the flame of small_flame_scene() truly is.
Box true_box(FlameShape shape) {
  FlameOptions options;
  options.shape = shape;
  const FlameTruth truth = Flame(options).at(Seconds(0), cube_grid(0.2, 64));
  const Grid& g = truth.medium.grid;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
  Eigen::Vector3d high = -low;
  each_point(voxels_of(g), [&](int i, int j, int k, std::size_t voxel) {
    if (truth.medium.inside[voxel] == 0) return;
    low = low.cwiseMin(place_of(g, i, j, k));
    high = high.cwiseMax(place_of(g, i + 1, j + 1, k + 1));
  });
  return {0.5 * (low + high), high - low};
}

TEST(FindBoxTest, HoldsTheFlameAndLittleMore) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const Scene scene = small_flame_scene(PerMeter(32.8), shape);
    const auto box = value_of(find_box(scene, flame_masks(scene)));
    const Box truth = true_box(shape);
    for (int a = 0; a < 3; ++a) {
      EXPECT_LE(box.center[a] - box.size[a] / 2, truth.center[a] - truth.size[a] / 2 + 3e-3) << a;
      EXPECT_GE(box.center[a] + box.size[a] / 2, truth.center[a] + truth.size[a] / 2 - 3e-3) << a;
      EXPECT_LT(box.size[a], 1.5 * truth.size[a]) << a;
    }
  }
}

TEST(FindBoxTest, ASpeckThatOneViewAloneShowsChangesNothing) {
  Scene scene = small_flame_scene();
  const auto before = value_of(find_box(scene, flame_masks(scene)));
  edit(scene.views[3].image, [](RadianceImage& image) {
    for (std::size_t y = 2; y < 6; ++y) std::fill_n(&image.rgb[3 * (160 * y + 150)], 3 * 5, 200.F);
  });
  const auto after = value_of(find_box(scene, flame_masks(scene)));
  EXPECT_LT((before.center - after.center).norm(), 5e-3);
  EXPECT_LT((before.size - after.size).norm(), 8e-3);
}

TEST(FindBoxTest, ASmallerBoxTakesFewerVoxels) {
  Scene scene = small_flame_scene();
  const int told = finest_voxels(scene);
  scene.box = *find_box(scene, flame_masks(scene));
  const int found = finest_voxels(scene);
  EXPECT_LT(found, told);
  EXPECT_GT(found, told / 3);
}

TEST(FindBoxTest, ADarkViewIsLeftOutAndNamedWhereTooFewSeeFlame) {
  Scene scene = small_flame_scene();
  Scene others = scene;
  others.views.erase(others.views.begin() + 4);
  const auto darken = [&](std::size_t v) { scene.views[v].image = share(RadianceImage({160, 120})); };
  darken(4);
  const Box box = value_of(find_box(scene, flame_masks(scene)));
  const Box without = value_of(find_box(others, flame_masks(others)));
  EXPECT_EQ(box.center, without.center);
  EXPECT_EQ(box.size, without.size);
  for (std::size_t v = 4; v < scene.views.size(); ++v) darken(v);
  for (const std::size_t v : {0, 1, 3}) darken(v);
  EXPECT_THAT(find_box(scene, flame_masks(scene)), FailsWith("camera 0", "--box"));
}

TEST(FindBoxTest, OneViewAndParallelViewsHaveNoEndInDepth) {
  Scene scene = small_flame_scene();
  scene.views.resize(1);
  EXPECT_THAT(find_box(scene, flame_masks(scene)), FailsWith("one view alone"));
  scene.views.push_back(scene.views[0]);
  Rigid3& pose = scene.views[1].camera.camera_from_world;
  pose.translation += Eigen::Vector3d(0.003, 0, 0);
  EXPECT_THAT(find_box(scene, flame_masks(scene)), FailsWith("no end in depth"));
}

TEST(FindBoxTest, WrongPosesDontMeet) {
  Scene scene = small_flame_scene();
  scene.views[0].camera.camera_from_world.translation += Eigen::Vector3d(0.1, 0, 0);
  EXPECT_THAT(find_box(scene, flame_masks(scene)),
              FailsWith("don't meet anywhere in space, but without camera 0 they do"));
}

TEST(FindBoxTest, ACameraThatLooksAwayIsLeftOutWhateverItShows) {
  Scene scene = small_flame_scene();
  Scene others = scene;
  others.views.erase(others.views.begin() + 4);
  const Box without = value_of(find_box(others, flame_masks(others)));
  const Rigid3 aimed = scene.views[4].camera.camera_from_world;
  for (const double degrees : {90, 180, 250}) {
    const Eigen::Matrix3d turn(Eigen::AngleAxisd(degrees * M_PI / 180, Eigen::Vector3d::UnitY()));
    scene.views[4].camera.camera_from_world = {turn * aimed.rotation, turn * aimed.translation};
    const Box box = value_of(find_box(scene, flame_masks(scene)));
    EXPECT_EQ(box.center, without.center) << degrees;
    EXPECT_EQ(box.size, without.size) << degrees;
  }
}

}  // namespace
}  // namespace emberlock::recon
