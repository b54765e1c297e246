// SPDX-License-Identifier: Apache-2.0
// Pixels that a view leaves out (View::bounds).
#include <algorithm>
#include <cstdint>

#include <gtest/gtest.h>

#include "recon/adjust/picture_error.h"
#include "recon/hull/hull.h"
#include "recon/views/flame_mask.h"
#include "recon/views/picture_clues.h"
#include "tests/support/ball_scene.h"
#include "tests/support/pictures.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

/// The view without the pixels where hidden(x, y) holds.
template <class Hidden>
View without(View view, const Hidden& hidden) {
  const ImageSize size = view.image->size;
  std::vector<std::uint8_t> marks;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) marks.push_back(hidden(x, y) ? kLeftOutMarks : 0);
  const RadianceImage& all = *view.image;
  view.image = share(radiance_of(size, [&](int x, int y, int c) {
    return hidden(x, y) ? 0.F : all.rgb[static_cast<std::size_t>(3 * (y * size.width + x) + c)];
  }));
  view.bounds = share(std::move(marks));
  return view;
}

Scene ball() { return ball_scene({.views = 6, .image = {80, 60}, .noise = 0.5}); }

TEST(LeftOutPixels, CountAsFlameAndDontMoveTheThreshold) {
  Scene scene = ball();
  const double threshold = flame_masks(scene)[0].threshold;
  const auto hidden = [](int x, int) { return x < 48; };  // more than half of the blocks
  scene.views[0] = without(scene.views[0], hidden);
  const FlameMask mask = flame_masks(scene)[0];
  EXPECT_NEAR(mask.threshold, threshold, 0.5 * threshold);
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 48; ++x) ASSERT_TRUE(mask.at(x, y));
  EXPECT_FALSE(mask.at(79, 0));
}

TEST(LeftOutPixels, BelongToTheFlamesBoxWhereTheyTouchIt) {
  Scene scene = ball();
  const PixelBox flame = flame_masks(scene, 20)[0].box;
  scene.views[0] = without(scene.views[0], [](int x, int y) { return x < 4 && y < 4; });
  const PixelBox apart = flame_masks(scene, 20)[0].box;
  EXPECT_EQ(apart.x0, flame.x0);
  EXPECT_EQ(apart.y0, flame.y0);
  scene.views[0] = without(ball().views[0], [&](int x, int) { return x < flame.x0 + 3; });
  EXPECT_EQ(flame_masks(scene, 20)[0].box.x0, 0);
}

TEST(LeftOutPixels, CarveNothing) {
  Scene scene = ball();
  const Grid grid = grid_over(scene.box, 24);
  const Hull whole = value_of(carve(scene, flame_masks(scene), grid, {}));
  scene.views[0] = without(scene.views[0], [](int x, int) { return x % 7 < 3; });
  const Hull hull = value_of(carve(scene, flame_masks(scene), grid, {}));
  for (std::size_t v = 0; v < hull.inside.size(); ++v) EXPECT_GE(hull.inside[v], whole.inside[v]);
}

TEST(LeftOutPixels, AreInNoError) {
  const View view = without(ball().views[0], [](int x, int) { return x >= 40; });
  RadianceImage wrong = *view.image;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 80; ++x)
      for (int c = 0; c < 3; ++c)
        wrong.rgb[static_cast<std::size_t>(3 * (y * 80 + x) + c)] += x < 40 ? 2.F : 100.F;
  for (const double error : rmse(view, wrong, {})) EXPECT_NEAR(error, 2, 1e-5);
  for (const double error : rmse(view, wrong, {30, 0, 80, 60})) EXPECT_NEAR(error, 2, 1e-5);
}

TEST(LeftOutPixels, ArentSaturatedOnes) {
  Scene scene = ball();
  scene.views[0] = without(scene.views[0], [](int x, int) { return x < 9; });
  EXPECT_TRUE(leaves_out(scene.views[0]));
  EXPECT_FALSE(marks_saturation(scene.views[0]));
  EXPECT_FALSE(leaves_out(scene.views[1]));
}

}  // namespace
}  // namespace emberlock::recon
