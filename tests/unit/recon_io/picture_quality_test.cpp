// SPDX-License-Identifier: Apache-2.0
#include "recon/export/picture_quality.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include <gtest/gtest.h>

#include "tests/support/pictures.h"

namespace emberlock::recon {
namespace {

Image picture(const std::function<int(int x, int y, int c)>& value) {
  return image_of({{40, 30}, PixelFormat::rgb8, 8}, value);
}
Image even(int level) {
  return picture([&](int, int, int) { return level; });
}

TEST(PictureQuality, PsnrIsThatOfTheMeanSquare) {
  EXPECT_NEAR(psnr(even(100), even(105)), 20 * std::log10(255.0 / 5), 1e-9);
  EXPECT_TRUE(std::isinf(psnr(even(7), even(7))));
  // One channel of one pixel in 1200, off by 30.
  const Image one = picture([](int x, int y, int c) { return x == 3 && y == 4 && c == 1 ? 130 : 100; });
  EXPECT_NEAR(psnr(one, even(100)), 10 * std::log10(255.0 * 255 / (900.0 / 3600)), 1e-9);
}

TEST(PictureQuality, SsimOfEvenPicturesComparesTheirMeansAlone) {
  const double c1 = std::pow(0.01 * 255, 2);
  EXPECT_NEAR(ssim(even(100), even(150)), (2 * 100 * 150 + c1) / (100 * 100 + 150 * 150 + c1), 1e-6);
  EXPECT_NEAR(ssim(even(100), even(100)), 1, 1e-9);
}

TEST(PictureQuality, SsimFallsWithNoiseAndIsNegativeOfANegative) {
  std::mt19937 random(1);
  const auto waves = [](int x, int y, int) {
    return 128 + static_cast<int>(60 * std::sin(0.7 * x) * std::cos(0.5 * y));
  };
  const Image clean = picture(waves);
  const auto noisy = [&](double sigma) {
    std::normal_distribution<> noise(0, sigma);
    return picture([&](int x, int y, int c) {
      return std::clamp(waves(x, y, c) + static_cast<int>(noise(random)), 0, 255);
    });
  };
  const double little = ssim(clean, noisy(5));
  const double much = ssim(clean, noisy(30));
  EXPECT_LT(little, 0.999);
  EXPECT_GT(little, much);
  EXPECT_GT(much, 0.1);
  EXPECT_LT(ssim(clean, picture([&](int x, int y, int c) { return 256 - waves(x, y, c); })), -0.5);
}

TEST(PictureQuality, FlickerIsTheChangeOverBothFramesBoxes) {
  const auto lit = [](int from, int level) {
    return picture([=](int x, int, int) { return x >= from && x < from + 10 ? level : 0; });
  };
  const ShownFrame before{{lit(5, 40)}, {lit(5, 30)}, {{5, 0, 15, 30}}};
  const ShownFrame now{{lit(5, 60)}, {lit(5, 40)}, {{5, 0, 25, 30}}};
  const auto found = flicker(before, now);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->pictures, 20 / std::sqrt(2.0), 1e-9);  // half of the columns change
  EXPECT_NEAR(found->renders, 10 / std::sqrt(2.0), 1e-9);
  EXPECT_FALSE(flicker({}, now));
  const ShownFrame dark{{even(0)}, {even(0)}, {{}}};
  EXPECT_FALSE(flicker(dark, dark));
  EXPECT_TRUE(flicker(dark, now));
}

}  // namespace
}  // namespace emberlock::recon
