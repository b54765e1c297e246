// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/find_box.h"

#include <gmock/gmock.h>

#include "recon/pipeline/grid_choice.h"
#include "tests/support/edit_view.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

/// Where the flame of small_flame_scene() truly is.
Box true_box(FlameShape shape) {
  FlameOptions options;
  options.shape = shape;
  const FlameTruth truth = Flame(options).at(Seconds(0), grid_over({{0, 0, 0}, {0.2, 0.2, 0.2}}, 64));
  const Grid& g = truth.medium.grid;
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9);
  Eigen::Vector3d high = -low;
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i) {
        if (truth.medium.inside[voxel++] == 0) continue;
        const Eigen::Vector3d corner = Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>() +
                                       static_cast<double>(g.edge) * Eigen::Vector3d(i, j, k);
        low = low.cwiseMin(corner);
        high = high.cwiseMax(corner + Eigen::Vector3d::Constant(static_cast<double>(g.edge)));
      }
  return {0.5 * (low + high), high - low};
}

TEST(FindBoxTest, HoldsTheFlameAndLittleMore) {
  for (const FlameShape shape : {FlameShape::plume, FlameShape::two_plumes}) {
    const Scene scene = small_flame_scene(PerMeter(32.8), shape);
    const auto box = find_box(scene, flame_masks(scene));
    ASSERT_TRUE(box.ok()) << box.error().message();
    const Box truth = true_box(shape);
    for (int a = 0; a < 3; ++a) {
      EXPECT_LE(box->center[a] - box->size[a] / 2, truth.center[a] - truth.size[a] / 2 + 3e-3) << a;
      EXPECT_GE(box->center[a] + box->size[a] / 2, truth.center[a] + truth.size[a] / 2 - 3e-3) << a;
      EXPECT_LT(box->size[a], 1.5 * truth.size[a]) << a;
    }
  }
}

TEST(FindBoxTest, ASpeckThatOneViewAloneShowsChangesNothing) {
  Scene scene = small_flame_scene();
  const auto before = find_box(scene, flame_masks(scene));
  edit(scene.views[3].image, [](RadianceImage& image) {
    for (int y = 2; y < 6; ++y)
      for (int x = 150; x < 155; ++x)
        for (std::size_t c = 0; c < 3; ++c) image.rgb[3 * static_cast<std::size_t>(160 * y + x) + c] = 200;
  });
  const auto after = find_box(scene, flame_masks(scene));
  ASSERT_TRUE(before.ok() && after.ok());
  EXPECT_LT((before->center - after->center).norm(), 5e-3);
  EXPECT_LT((before->size - after->size).norm(), 8e-3);
}

TEST(FindBoxTest, ASmallerBoxTakesFewerVoxels) {
  Scene scene = small_flame_scene();
  const int told = finest_voxels(scene);
  scene.box = *find_box(scene, flame_masks(scene));
  const int found = finest_voxels(scene);
  EXPECT_LT(found, told);
  EXPECT_GT(found, told / 3);
}

TEST(FindBoxTest, ADarkViewIsNamed) {
  Scene scene = small_flame_scene();
  scene.views[4].image = share(RadianceImage({160, 120}));
  const auto box = find_box(scene, flame_masks(scene));
  ASSERT_FALSE(box.ok());
  EXPECT_THAT(box.error().message(), HasSubstr("camera 4"));
  EXPECT_THAT(box.error().message(), HasSubstr("--box"));
}

TEST(FindBoxTest, OneViewAndParallelViewsHaveNoEndInDepth) {
  Scene scene = small_flame_scene();
  scene.views.resize(1);
  EXPECT_THAT(find_box(scene, flame_masks(scene)).error().message(), HasSubstr("one view alone"));
  scene.views.push_back(scene.views[0]);
  Rigid3& pose = scene.views[1].camera.camera_from_world;
  pose.translation += Eigen::Vector3d(0.003, 0, 0);
  EXPECT_THAT(find_box(scene, flame_masks(scene)).error().message(), HasSubstr("no end in depth"));
}

TEST(FindBoxTest, WrongPosesDontMeet) {
  Scene scene = small_flame_scene();
  scene.views[0].camera.camera_from_world.translation += Eigen::Vector3d(0.5, 0, 0);
  EXPECT_THAT(find_box(scene, flame_masks(scene)).error().message(), HasSubstr("don't meet"));
}

}  // namespace
}  // namespace emberlock::recon
