// SPDX-License-Identifier: Apache-2.0
#include "recon/views/picture_clues.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/pictures.h"

namespace emberlock::recon {
namespace {

constexpr ImageSize kSize{64, 48};
const PixelBox kWhole{0, 0, kSize.width, kSize.height};

template <class Light>
View view_of(const Light& light) {
  View view;
  view.image = share(radiance_of(kSize, light));
  return view;
}

/// A flame that stands on the lower border, before an even level.
double flame_on_the_floor(int x, int y, int c) {
  const bool flame = std::abs(x - 32) < 10 && y > 20;
  return flame ? 200 : 6 + c;
}

TEST(PictureClues, BorderLevelIsWhatTheFlameLeavesFree) {
  Scene scene;
  scene.views = {view_of(flame_on_the_floor)};
  const auto border = border_level(scene, {flame_mask(*scene.views[0].image, 50)});
  ASSERT_TRUE(border);
  EXPECT_EQ(border->level, (std::array<double, 3>{6, 7, 8}));
  EXPECT_EQ(border->unevenness, 0);
}

TEST(PictureClues, BorderLevelSaysHowUnevenItIs) {
  Scene scene;
  scene.views = {view_of([](int x, int, int) { return x < 16 ? 12 : 4; }),
                 view_of([](int, int, int) { return 4; })};
  const auto border =
      border_level(scene, {flame_mask(*scene.views[0].image, 50), flame_mask(*scene.views[1].image, 50)});
  ASSERT_TRUE(border);
  EXPECT_EQ(border->level[0], 5);  // one of eight sides has 12
  EXPECT_EQ(border->unevenness, 7);
}

TEST(PictureClues, HeldOutViewsAndBordersFullOfFlameTellNothing) {
  Scene scene;
  scene.views = {view_of([](int, int, int) { return 100; }), view_of([](int, int, int) { return 9; })};
  scene.views[1].role = ViewRole::held_out;
  EXPECT_FALSE(
      border_level(scene, {flame_mask(*scene.views[0].image, 50), flame_mask(*scene.views[1].image, 50)}));
}

/// A paraboloid of `top`, above its surroundings by 200 at most.
double hill(int x, int y, double top) {
  return std::max(0.0, top - 0.5 * (std::pow(x - 31.7, 2) + std::pow(y - 24.2, 2)));
}

TEST(PictureClues, AParaboloidCutOffAtWhiteIsContinuedExactly) {
  constexpr double kTop = 300;
  Scene scene;
  scene.views = {view_of([](int x, int y, int) { return std::min(255.0, hill(x, y, kTop)); })};
  EXPECT_EQ(clip_level(scene, {kWhole}, 255), 255);
  double missing = 0;
  double share = 0;
  for (int y = 0; y < kSize.height; ++y) {
    for (int x = 0; x < kSize.width; ++x) {
      const double over = std::max(0.0, hill(x, y, kTop) - 255);
      missing += over * over / (kSize.width * kSize.height);
      share += (over > 0 ? 1.0 : 0.0) / (kSize.width * kSize.height);
    }
  }
  const ClippedPixels clipped = clipped_pixels(scene, {kWhole}, 255);
  EXPECT_NEAR(clipped.share, share, 1e-12);
  EXPECT_NEAR(clipped.excess / std::sqrt(missing), 1, 0.25);  // slopes are taken outside: 1 or 2 pixels off
}

TEST(PictureClues, PicturesClipWhereTheirBrightestPixelsPileUp) {
  const auto level = [](double top, double cut) {
    Scene scene;
    scene.views = {view_of([&](int x, int y, int) { return std::min(cut, hill(x, y, top)); })};
    return clip_level(scene, {kWhole}, 255);
  };
  EXPECT_EQ(level(300, 1000), 0);      // brighter than white, and no end
  EXPECT_EQ(level(200, 1000), 0);      // dark
  EXPECT_EQ(level(200, 150), 0);       // flat, but far from white
  EXPECT_EQ(level(300, 241), 241);     // a black level was taken out
  EXPECT_EQ(level(1500, 1023), 1023);  // a wider range than told
}

}  // namespace
}  // namespace emberlock::recon
