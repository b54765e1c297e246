// SPDX-License-Identifier: Apache-2.0
#include "recon/export/preview.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "recon/export/picture.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

TEST(Preview, KeepsProportionsAndNeverGrows) {
  EXPECT_EQ(preview_size({1280, 720}, 480), (ImageSize{480, 270}));
  EXPECT_EQ(preview_size({320, 240}, 480), (ImageSize{320, 240}));
  EXPECT_EQ(preview_size({5000, 1}, 480), (ImageSize{480, 1}));
}

TEST(Preview, ASmallPictureShowsTheSamePointsAtTheSamePlaces) {
  CameraModel camera{{{1281, 719}, 900, 910, 640, 350, {0.1, -0.05, 0.001, 0.002, 0}}, {}};
  const CameraModel small = resized(camera, {480, 270});
  const Eigen::Vector3d world(0.2, -0.1, 1);
  const Eigen::Vector2d full = camera.project(world);
  const Eigen::Vector2d there = small.project(world);
  EXPECT_NEAR(there.x() / 480, full.x() / 1281, 1e-12);
  EXPECT_NEAR(there.y() / 270, full.y() / 719, 1e-12);
}

TEST(Preview, ShrinkingKeepsTheMeanOfEachChannel) {
  RadianceImage image({60, 40});
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = static_cast<float>(i * 7919 % 251);
  const RadianceImage small = shrunk(image, {20, 10});
  const auto mean = [](const RadianceImage& of, std::size_t c) {
    double sum = 0;
    for (std::size_t i = c; i < of.rgb.size(); i += 3) sum += of.rgb[i];
    return 3 * sum / static_cast<double>(of.rgb.size());
  };
  for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(mean(small, c), mean(image, c), 1e-3);
}

TEST(Preview, CoarseBlocksHoldTheMeanOfTheirPointsEvenWhereTheyAreCutOff) {
  Volume volume;
  volume.grid = {{-1, -2, -3}, 0.5F, 10, 7, 4};
  volume.emission.resize(3 * volume.grid.size());
  for (std::size_t i = 0; i < volume.emission.size(); ++i)
    volume.emission[i] = static_cast<float>(i * 31 % 97);
  const CoarseBrightness coarse = coarse_brightness(volume, 4);  // blocks of three points
  ASSERT_EQ((std::array{coarse.nx, coarse.ny, coarse.nz}), (std::array{4, 3, 2}));
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_NEAR(coarse.box.size[axis], 1.5 * (4 - axis), 1e-6);
    // The first point lies in the middle of its own half voxel edge.
    EXPECT_NEAR(coarse.box.center[axis] - coarse.box.size[axis] / 2, -1.25 - axis, 1e-6);
  }
  double brightest = 0;
  std::size_t v = 0;
  for (int k = 0; k < 2; ++k)
    for (int j = 0; j < 3; ++j)
      for (int i = 0; i < 4; ++i, ++v) {
        double sum = 0;
        int values = 0;
        for (int z = 3 * k; z < std::min(4, 3 * k + 3); ++z)
          for (int y = 3 * j; y < std::min(7, 3 * j + 3); ++y)
            for (int x = 3 * i; x < std::min(10, 3 * i + 3); ++x)
              for (std::size_t c = 0; c < 3; ++c, ++values)
                sum += volume.emission[3 * volume.grid.index(x, y, z) + c];
        brightest = std::max(brightest, sum / values);
        EXPECT_NEAR(coarse.voxels[v], 255 * sum / values / coarse.brightest, 0.51)
            << i << " " << j << " " << k;
      }
  EXPECT_NEAR(coarse.brightest, brightest, 1e-4);
}

TEST(Preview, CoarseLightHasTheColoursOfItsPoints) {
  Volume volume;
  volume.grid = {{0, 0, 0}, 1, 5, 2, 2};
  for (std::size_t i = 0; i < 3 * volume.grid.size(); ++i)
    volume.emission.push_back(static_cast<float>(i % 3 + 1) * static_cast<float>(1 + i / 3 % 5));
  const std::vector<float> light = coarse_emission(volume, 3);  // blocks of two points along x
  ASSERT_EQ(light.size(), 9U);
  const float means[] = {1.5F, 3.5F, 5.0F};
  for (std::size_t i = 0; i < light.size(); ++i)
    EXPECT_FLOAT_EQ(light[i], static_cast<float>(i % 3 + 1) * means[i / 3]) << i;
}

TEST(Preview, ALayerIsTheMeanOfWhatIsToldAndZeroWhereNothingIs) {
  const Grid grid{{0, 0, 0}, 1, 6, 1, 1};
  const std::vector<float> kelvin = {1500, 0, 0, 0, 1600, 1700};
  const CoarseLayer layer = coarse_layer(
      CoarseLayer::Kind::temperature, grid, 3, [&](std::size_t p) { return kelvin[p]; },
      kelvin_bar(1510, 1620));
  ASSERT_EQ(layer.voxels.size(), 3U);
  EXPECT_EQ(layer.low, 1500);
  EXPECT_EQ(layer.high, 1650);
  EXPECT_EQ(layer.voxels[0], 1) << "1500 K, though half of its points tell nothing";
  EXPECT_EQ(layer.voxels[1], 0);
  EXPECT_EQ(layer.voxels[2], 255);
}

TEST(Preview, ErrorsAreShownFromZeroAndWhatLiesBeyondTheEndAsTheEnd) {
  std::vector<float> sigma(200, 2.31F);
  sigma[0] = 1000;  // one voxel that tells hardly anything
  sigma[1] = 0;
  sigma[2] = 1.2F;
  const CoarseLayer layer = layer_of(CoarseLayer::Kind::extinction_sigma, sigma);
  EXPECT_EQ(layer.low, 0);
  EXPECT_NEAR(layer.high, 2.4, 1e-9);
  EXPECT_EQ(layer.voxels[0], 255);
  EXPECT_EQ(layer.voxels[1], 0);
  EXPECT_EQ(layer.voxels[2], 128);
  const CoarseLayer nothing = layer_of(CoarseLayer::Kind::temperature, std::vector<float>(4));
  EXPECT_EQ(nothing.voxels, std::vector<std::uint8_t>(4));
}

TEST(Preview, ATemperaturesBarEndsWhereTheLightDoes) {
  // A dim edge of many blocks that tell little, and a bright flame of a few.
  std::vector<float> kelvin;
  std::vector<float> light;
  for (int i = 0; i < 200; ++i) kelvin.push_back(i % 2 == 0 ? 900.0F : 3500.0F);
  light.assign(3 * 200, 5);
  for (int i = 0; i <= 50; ++i) kelvin.push_back(1610 + 3.6F * static_cast<float>(i));
  light.resize(3 * kelvin.size(), 1000);
  kelvin.push_back(0);  // not told, however bright
  light.resize(3 * kelvin.size(), 1e6F);
  const BarEnds middle = middle_by_light(kelvin, light);
  const BarEnds bar = kelvin_bar(middle.low, middle.high);
  EXPECT_EQ(bar.low, 1600);
  EXPECT_EQ(bar.high, 1800);
  EXPECT_EQ(middle_by_light({0, 0}, {1, 1, 1, 1, 1, 1}).high, 0);
  EXPECT_EQ(kelvin_bar(1700, 1700).high, 1750);
  EXPECT_EQ(kelvin_sigma_bar(1).high, 10);
  EXPECT_EQ(kelvin_sigma_bar(13).high, 40);
}

TEST(Preview, ADarkVolumeIsDark) {
  Volume volume;
  volume.grid = {{0, 0, 0}, 1, 300, 2, 2};
  volume.emission.assign(3 * volume.grid.size(), -1.0F);
  const CoarseBrightness coarse = coarse_brightness(volume, 64);
  EXPECT_LE(coarse.nx, 64);
  EXPECT_EQ(coarse.brightest, 0);
  EXPECT_EQ(std::count(coarse.voxels.begin(), coarse.voxels.end(), 0), coarse.nx * coarse.ny * coarse.nz);
}

TEST(Preview, AJpegTakesColourAloneAndSomethingToShow) {
  const auto jpeg = value_of(to_jpeg(Image(ImageLayout{{16, 8}, PixelFormat::rgb8, 8}).view()));
  EXPECT_EQ(jpeg.substr(0, 2), "\xff\xd8");
  EXPECT_FALSE(to_jpeg(Image(ImageLayout{{16, 8}, PixelFormat::gray8, 8}).view()).ok());
  EXPECT_FALSE(to_jpeg(Image(ImageLayout{{0, 0}, PixelFormat::rgb8, 8}).view()).ok());
}

}  // namespace
}  // namespace emberlock::recon
