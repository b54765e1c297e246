// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/radiance.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/pictures.h"

namespace emberlock::recon {
namespace {

float at(const RadianceImage& image, int x, int y, int c) {
  return image.rgb[3 * (y * image.size.width + x) + c];
}

TEST(Radiance, WhiteIs255WhateverTheBitDepth) {
  for (const int depth : {10, 12, 16}) {
    Image image(ImageLayout{{2, 1}, PixelFormat::gray16, depth});
    image.row_as<std::uint16_t>(0)[0] = static_cast<std::uint16_t>(image.layout().white());
    const RadianceImage radiance = to_radiance(image.view());
    EXPECT_FLOAT_EQ(at(radiance, 0, 0, 0), 255) << depth;
    EXPECT_EQ(at(radiance, 0, 0, 2), at(radiance, 0, 0, 0)) << "grey fills all channels";
    EXPECT_EQ(at(radiance, 1, 0, 1), 0);
  }
}

TEST(Radiance, ColourKeepsItsChannels) {
  Image image(ImageLayout{{1, 1}, PixelFormat::rgb8, 8});
  const std::uint8_t rgb[] = {200, 100, 50};
  std::copy(rgb, rgb + 3, image.row_as<std::uint8_t>(0));
  const RadianceImage radiance = to_radiance(image.view());
  for (int c = 0; c < 3; ++c) EXPECT_FLOAT_EQ(at(radiance, 0, 0, c), rgb[c]);
}

/// A mosaic of a scene whose channels are linear in x and y: bilinear interpolation gives it back exactly.
TEST(Radiance, AMosaicOfLinearRampsIsRestoredInsideAndKeepsItsSamples) {
  constexpr int kSide = 8;
  const auto ramp = [](int x, int y, int c) { return 10 + (c + 1) * 3 * x + (3 - c) * 4 * y; };
  const Image mosaic = image_of({{kSide, kSide}, PixelFormat::bayer_rggb8, 8},
                                [&](int x, int y, int) { return ramp(x, y, (x & 1) + (y & 1)); });
  const RadianceImage radiance = to_radiance(mosaic.view());
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      EXPECT_EQ(at(radiance, x, y, (x & 1) + (y & 1)), ramp(x, y, (x & 1) + (y & 1)));
      if (x == 0 || y == 0 || x == kSide - 1 || y == kSide - 1) continue;
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(at(radiance, x, y, c), ramp(x, y, c), 1e-4) << x << ' ' << y << ' ' << c;
    }
  }
}

TEST(Radiance, AMosaicOfOneColumnHasNoBlueAndStaysFinite) {
  const Image mosaic(ImageLayout{{1, 3}, PixelFormat::bayer_rggb8, 8});
  for (const float value : to_radiance(mosaic.view()).rgb) EXPECT_EQ(value, 0);
}

TEST(Radiance, EightBitsRoundAndClamp) {
  RadianceImage image({2, 1});
  image.rgb = {-3.0F, 0.5F, 254.4F, 300.0F, NAN, INFINITY};
  const Image out = to_rgb8(image);
  const std::uint8_t expected[] = {0, 1, 254, 255, 0, 255};
  for (int i = 0; i < 6; ++i) EXPECT_EQ(out.view().row_as<std::uint8_t>(0)[i], expected[i]) << i;
}

}  // namespace
}  // namespace emberlock::recon
