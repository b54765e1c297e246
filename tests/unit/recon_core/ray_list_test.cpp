// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/ray_list.h"

#include <set>

#include <gtest/gtest.h>

#include "tests/support/devices.h"
#include "tests/support/march_case.h"

namespace emberlock::recon {
namespace {

ON_EACH_DEVICE_SANITIZED_TOO(RayListOn);

/// Bayer's matrix (1973), as it is printed.
constexpr int kBayer[4][4] = {{0, 8, 2, 10}, {12, 4, 14, 6}, {3, 11, 1, 9}, {15, 7, 13, 5}};

TEST(PixelRule, DealsPixelsInBayersOrder) {
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 9; ++x) EXPECT_EQ(bayer(x, y), kBayer[y % 4][x % 4]) << x << ", " << y;
}

TEST(PixelRule, KeepsOnePixelInThirtyTwoOrAView) {
  PixelRule rule;
  rule.stride = 2;
  rule.dealt = rule.held_out = 4;
  int held_out = 0;
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      const int subset = rule(3, x, y);
      if (x % 2 != 0 || y % 2 != 0) {
        EXPECT_EQ(subset, -1);
      } else if (subset == 4) {
        ++held_out;
      } else {
        EXPECT_EQ(subset, kBayer[y / 2 % 4][x / 2 % 4] / 4);
      }
    }
  EXPECT_NEAR(held_out, 10000 / 32, 60);
  rule.left_out = 3;
  EXPECT_EQ(rule(3, 10, 10), 4);
  EXPECT_NE(rule(2, 10, 10), 4);
  rule.others = 1;
  EXPECT_EQ(rule(3, 1, 0), 1);
}

/// A rule that a GPU follows by itself, and the same asked pixel by pixel.
TEST_P(RayListOn, PixelsAreDealtAlikeWhoeverDealsThem) {
  const MarchCase c = march_case();
  const std::vector<const CameraModel*> cameras = {&c.cameras[0], &c.cameras[1]};
  Pool pool(2, device_here());
  PixelRule interleaved;
  interleaved.stride = 1;
  interleaved.dealt = interleaved.held_out = 4;
  PixelRule sparse;
  sparse.stride = 3;
  sparse.others = 1;
  PixelRule by_view;
  by_view.by_view = true;
  PixelRule left_out = interleaved;
  left_out.left_out = 1;
  for (const PixelRule& rule : {PixelRule{}, interleaved, sparse, by_view, left_out})
    for (const bool boxed : {false, true}) {
      RayListOptions options;
      options.subsets = 5;
      options.rule = rule;
      if (boxed) options.boxes = {{7, 3, 31, 30}, {0, 11, 1, 12}};
      const RayList dealt = clip_rays(cameras, c.medium, options, pool);
      options.subset_of = [&](std::size_t view, int x, int y) { return rule(view, x, y); };
      const RayList asked = clip_rays(cameras, c.medium, options, pool);
      EXPECT_EQ(dealt.pixels, asked.pixels);
      EXPECT_EQ(dealt.subset_begin, asked.subset_begin);
      ASSERT_EQ(dealt.before.size(), 6U);
      for (std::size_t s = 0; s < dealt.before.size(); ++s) {
        EXPECT_EQ(dealt.before[s].rays, dealt.subset_begin[s]);
        EXPECT_EQ(dealt.before[s].runs, asked.before[s].runs);
        EXPECT_EQ(dealt.before[s].samples, asked.before[s].samples);
      }
      ASSERT_EQ(dealt.rays.size(), asked.rays.size());
      EXPECT_GT(dealt.rays.size(), boxed ? 20U : 300U);
      std::set<int> subsets;
      for (std::size_t s = 0; s + 1 < dealt.subset_begin.size(); ++s)
        for (std::size_t r = dealt.subset_begin[s]; r < dealt.subset_begin[s + 1]; ++r) {
          const int x = static_cast<int>(dealt.pixels[r]) % 40;
          const int y = static_cast<int>(dealt.pixels[r]) / 40;
          EXPECT_EQ(rule(dealt.rays[r].view, x, y), static_cast<int>(s));
          EXPECT_TRUE(!boxed || dealt.rays[r].view == 1 || (x >= 7 && x < 31 && y >= 3));
          subsets.insert(static_cast<int>(s));
        }
      EXPECT_GT(dealt.count().samples, dealt.count().rays);
      double length = 0;
      for (const recon::Run& run : asked.runs) length += static_cast<double>(run.step) * run.count;
      EXPECT_NEAR(total_length(dealt, pool), length, 1e-9 * length);
    }
}

TEST_P(RayListOn, AViewThatNoRayCrossesTheMediumFromHasNone) {
  const MarchCase c = march_case();
  const CameraModel away = look_at(c.cameras[0].intrinsics, {0.3, 0.1, 0.05}, {0.6, 0.2, 0.1});
  Pool pool(2, device_here());
  RayListOptions options;
  options.subsets = 3;
  options.rule.by_view = true;
  const RayList list = clip_rays({&away, &c.cameras[1], &away}, c.medium, options, pool);
  EXPECT_EQ(list.before[1].rays, 0U);
  EXPECT_GT(list.before[2].rays, 0U);
  EXPECT_EQ(list.before[3].rays, list.before[2].rays);
  const RayList none = clip_rays({&away}, c.medium, {}, pool);
  EXPECT_EQ(none.count().rays, 0U);
  EXPECT_EQ(total_length(none, pool), 0);
}

}  // namespace
}  // namespace emberlock::recon
