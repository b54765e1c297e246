// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/hull.h"

#include <cmath>

#include <gtest/gtest.h>

#include "recon/views/check_scene.h"
#include "tests/support/devices.h"
#include "tests/support/edit_view.h"
#include "tests/support/key_points.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE(HullTest);

/// Projects the corners of one voxel in double and looks at every pixel of their bounding rectangle.
bool stays(const Scene& scene, const std::vector<FlameMask>& masks, const Grid& g, int i, int j, int k) {
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    Eigen::Vector2d low(1e9, 1e9);
    Eigen::Vector2d high(-1e9, -1e9);
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector2d pixel =
          scene.views[v].camera.project(place_of(g, i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)));
      low = low.cwiseMin(pixel);
      high = high.cwiseMax(pixel);
    }
    const ImageSize size = masks[v].size;
    if (low.x() < 0 || low.y() < 0 || high.x() >= size.width || high.y() >= size.height) continue;
    bool flame = false;
    for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y)
      for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x)
        flame = flame || masks[v].at(x, y);
    if (!flame) return false;
  }
  return true;
}

TEST_P(HullTest, EqualsTheBruteForceProjectionOfEveryVoxel) {
  const Scene scene = small_flame_scene();
  const std::vector<FlameMask> masks = flame_masks(scene);
  const Grid grid = grid_over(scene.box, 37);
  const auto hull = value_of(carve(scene, masks, grid, {}));
  std::size_t different = 0;
  each_point(voxels_of(grid), [&](int i, int j, int k, std::size_t voxel) {
    different += stays(scene, masks, grid, i, j, k) != (hull.inside[voxel] != 0);
  });
  EXPECT_GT(hull.count, 500u);
  EXPECT_LT(hull.count, hull.inside.size() / 4);
  EXPECT_LE(different, 2u) << "float against double may differ where a corner meets a pixel's border";
}

TEST_P(HullTest, HoldsTheTrueMediumThatIsBrightEnoughToBeSeen) {
  const Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 48);
  const FlameTruth truth = Flame().at(Seconds(0), grid);
  const auto hull = value_of(carve(scene, flame_masks(scene), grid, {}));
  std::size_t lost = 0;
  for (std::size_t v = 0; v < hull.inside.size(); ++v)
    lost += truth.medium.inside[v] != 0 && hull.inside[v] == 0;
  EXPECT_LT(static_cast<double>(lost), 0.05 * static_cast<double>(truth.medium.count));
}

TEST_P(HullTest, ThresholdAboveEverythingIsAnErrorThatNamesViewAndThreshold) {
  const Scene scene = small_flame_scene();
  const Error hull = carve(scene, flame_masks(scene, 1000), grid_over(scene.box, 32), {}).error();
  EXPECT_EQ(hull.where, "camera 0");
  EXPECT_NE(hull.what.find("1e+03"), std::string::npos) << hull.message();
}

TEST_P(HullTest, ABlackViewIsNamed) {
  Scene scene = small_flame_scene();
  scene.views[3].image = share(RadianceImage({160, 120}));
  EXPECT_EQ(carve(scene, flame_masks(scene), grid_over(scene.box, 32), {}).error().where, "camera 3");
}

TEST_P(HullTest, HeldOutViewsDoNotCarve) {
  Scene scene = small_flame_scene();
  const Grid grid = grid_over(scene.box, 32);
  const auto before = value_of(carve(scene, flame_masks(scene), grid, {}));
  scene.views[10].image = share(RadianceImage({160, 120}));
  const auto after = value_of(carve(scene, flame_masks(scene), grid, {}));
  EXPECT_EQ(before.inside, after.inside);
}

TEST_P(HullTest, AVoxelThatAViewCannotSeeIsNotCarvedByIt) {
  Scene scene = small_flame_scene();
  scene.views.resize(1);
  scene.views[0].camera.intrinsics.cx += 100000;  // the box is far out of the frame
  const auto hull = value_of(carve(scene, flame_masks(scene), grid_over(scene.box, 8), {}));
  EXPECT_EQ(hull.count, hull.inside.size());
}

TEST_P(HullTest, SixtyFiveViewsAreRefused) {
  Scene scene = small_flame_scene();
  scene.views.resize(1);
  while (scene.views.size() < 65) scene.views.push_back(scene.views[0]);
  EXPECT_FALSE(carve(scene, flame_masks(scene), grid_over(scene.box, 8), {}).ok());
  scene.views.pop_back();
  EXPECT_TRUE(carve(scene, flame_masks(scene), grid_over(scene.box, 8), {}).ok());
}

TEST(CheckScene, NanAndInfiniteInputIsRefusedByName) {
  Scene scene = small_flame_scene();
  const SharedImage whole = scene.views[2].image;
  edit(scene.views[2].image, [](RadianceImage& image) { image.rgb[3 * (5 * 160 + 7) + 1] = std::nanf(""); });
  EXPECT_EQ(check_scene(scene).error().where, "camera 2");
  EXPECT_NE(check_scene(scene).error().what.find("(7, 5)"), std::string::npos);
  scene.views[2].image = whole;
  scene.views[4].camera.camera_from_world.translation.x() = INFINITY;
  EXPECT_EQ(check_scene(scene).error().where, "camera 4");
}

}  // namespace
}  // namespace emberlock::recon
