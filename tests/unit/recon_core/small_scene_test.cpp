// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/small_scene.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/pictures.h"

namespace emberlock::recon {
namespace {

using ::testing::ElementsAre;

/// One view of 4 x 4 pixels whose flame is all of it.
Scene scene_of_one_view() {
  Scene scene;
  scene.box = {{0, 0, 0}, {1, 1, 1}};
  View view;
  view.camera.intrinsics.size = {4, 4};
  view.image = share(radiance_of({4, 4}, [](int, int, int) { return 100; }));
  scene.views.push_back(view);
  return scene;
}

std::vector<FlameMask> mask_of_all() {
  FlameMask mask;
  mask.box = {0, 0, 4, 4};
  return {mask};
}

TEST(SmallScene, AMeanOverASaturatedPixelIsALowerBound) {
  Scene scene = scene_of_one_view();
  std::vector<std::uint8_t> bounds(16);
  bounds[0] = 1;   // red, top left
  bounds[5] = 4;   // blue, in the same four pixels
  bounds[14] = 2;  // green, bottom right
  scene.views[0].bounds = share(bounds);
  const std::vector<FlameMask> masks = mask_of_all();
  const Scene small = small_scene(scene, masks, 4);
  ASSERT_EQ(small.views[0].image->size.width, 2);
  EXPECT_THAT(*small.views[0].bounds, ElementsAre(5, 0, 0, 2));
  EXPECT_EQ(*small_scene(scene, masks, 16).views[0].bounds, bounds) << "not shrunk";
}

TEST(SmallScene, WithoutSaturatedPixelsThereAreNoBounds) {
  const std::vector<FlameMask> masks = mask_of_all();
  EXPECT_FALSE(small_scene(scene_of_one_view(), masks, 4).views[0].bounds);
}

}  // namespace
}  // namespace emberlock::recon
