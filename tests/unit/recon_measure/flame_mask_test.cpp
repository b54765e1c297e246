// SPDX-License-Identifier: Apache-2.0
#include "recon/views/flame_mask.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"
#include "recon/preprocess/radiance.h"
#include "recon/views/view.h"
#include "tests/support/devices.h"
#include "tests/support/pictures.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

/// Noise on a background, with a bright disc that crosses the picture's border and single bright pixels.
RadianceImage noisy_picture(ImageSize size, std::uint64_t seed) {
  return radiance_of(size, [&](int x, int y, int c) {
    const auto p = static_cast<std::uint64_t>(y * size.width + x);
    const bool lit =
        std::hypot(x, y - size.height / 2) < size.width / 3.0 || random_bits(seed, 3, p) % 40 == 0;
    return (lit ? 30 : 5) + random_normal(seed, static_cast<std::uint64_t>(c), p);
  });
}

float brightest(const RadianceImage& image, int x, int y) {
  const std::size_t p = 3 * static_cast<std::size_t>(y * image.size.width + x);
  return std::max({image.rgb[p], image.rgb[p + 1], image.rgb[p + 2]});
}

double upper_median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// The threshold block by block, as flame_mask.h describes it.
double threshold_by_blocks(const RadianceImage& image) {
  const int edge = std::clamp(std::min(image.size.width, image.size.height) / 12, 4, 16);
  std::vector<double> means;
  std::vector<double> peaks;
  for (int y = 0; y + edge <= image.size.height; y += edge)
    for (int x = 0; x + edge <= image.size.width; x += edge) {
      double sum = 0;
      double peak = -1e9;
      for (int i = 0; i < edge * edge; ++i) {
        const auto v = static_cast<double>(brightest(image, x + i % edge, y + i / edge));
        sum += v;
        peak = std::max(peak, v);
      }
      means.push_back(sum / (edge * edge));
      peaks.push_back(peak);
    }
  if (means.empty()) return 1;
  const double background = upper_median(means);
  return background +
         std::max(1.0, 6 / (std::sqrt(2 * std::log(edge * edge)) - 0.5) * (upper_median(peaks) - background));
}

std::array<int, 4> corners(const PixelBox& box) { return {box.x0, box.y0, box.x1, box.y1}; }

constexpr ImageSize kSizes[] = {{64, 48}, {37, 29}, {203, 61}, {5, 4}, {4, 7}, {3, 9}, {1, 1}, {2, 40}};

TEST(FlameMask, EqualsWhatLookingAtEachPixelAndItsNeighboursFinds) {
  for (const ImageSize size : kSizes) {
    const RadianceImage image = noisy_picture(size, static_cast<std::uint64_t>(size.width));
    const FlameMask mask = noise_mask(image);
    const double threshold = threshold_by_blocks(image);
    EXPECT_DOUBLE_EQ(mask.threshold, threshold);
    const auto lit = [&](int x, int y) {
      return x >= 0 && y >= 0 && x < size.width &&
             y<size.height&& static_cast<double>(brightest(image, x, y))> threshold;
    };
    PixelBox box{size.width, size.height, 0, 0};
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        int around = -1;
        for (int n = 0; n < 9; ++n) around += lit(x + n % 3 - 1, y + n / 3 - 1) ? 1 : 0;
        const bool flame = lit(x, y) && around >= 3;
        ASSERT_EQ(mask.at(x, y), flame) << size.width << " x " << size.height << " at " << x << ", " << y;
        if (flame)
          box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
      }
    if (box.empty()) box = {};
    EXPECT_EQ(corners(mask.box), corners(box));
  }
}

TEST(FlameMaskThreads, OfAllViewsAreTheSameOnAnyNumberOfThreads) {
  const Scene scene = small_flame_scene();
  const std::vector<FlameMask> alone = flame_masks(scene, {}, {Device::cpu, 1});
  const std::vector<FlameMask> three = flame_masks(scene, {}, {Device::cpu, 3});
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    EXPECT_EQ(alone[v].flame, three[v].flame);
    EXPECT_EQ(alone[v].flame, noise_mask(*scene.views[v].image).flame);
  }
}

TEST(FlameMaskThreads, OfAllViewsAreTheSameOnAnyDevice) {
  Scene scene = small_flame_scene();
  for (const ImageSize size : kSizes)
    scene.views.push_back({"noise", {}, share(noisy_picture(size, static_cast<std::uint64_t>(size.height)))});
  const std::optional<double> thresholds[] = {{}, 30, 1000, -1};
  for (const std::optional<double>& threshold : thresholds) {
    const std::vector<FlameMask> here = flame_masks(scene, threshold, {Device::cpu, 2});
    for (const Device device : other_devices()) {
      const std::vector<FlameMask> there = flame_masks(scene, threshold, {device, 2});
      for (std::size_t v = 0; v < scene.views.size(); ++v) {
        EXPECT_EQ(there[v].flame, here[v].flame) << "view " << v;
        EXPECT_EQ(there[v].threshold, here[v].threshold);
        EXPECT_EQ(there[v].size.width, here[v].size.width);
        EXPECT_EQ(corners(there[v].box), corners(here[v].box)) << "view " << v;
      }
    }
  }
}

TEST(FlameMask, ThresholdComesFromTheNoise) {
  PaperSceneOptions options = small_film({160, 120}, 48);
  EXPECT_DOUBLE_EQ(noise_threshold(*paper_scene(options).views[0].image), 1);
  options.noise = 2;
  const double threshold = noise_threshold(*paper_scene(options).views[0].image);
  EXPECT_GT(threshold, 4);
  EXPECT_LT(threshold, 14);
}

TEST(FlameMask, ThresholdOfADemosaicedPictureLiesAboveItsNoise) {
  // Interpolated samples share their neighbours' noise: differences of neighbours would see half of it.
  const Image mosaic = image_of({{320, 240}, PixelFormat::bayer_rggb8, 8}, [](int x, int y, int /*c*/) {
    return std::lround(20 + 2 * random_normal(1, 0, static_cast<std::uint64_t>(y * 320 + x)));
  });
  const RadianceImage image = to_radiance(mosaic.view());
  EXPECT_GT(noise_threshold(image), 20 + 4 * 2);
  EXPECT_TRUE(noise_mask(image).box.empty());
}

TEST(FlameMask, HotPixelsAreNoFlame) {
  RadianceImage image({40, 30});
  const auto light = [&](int x, int y) { image.rgb[3 * static_cast<std::size_t>(y * 40 + x)] = 200; };
  light(3, 4);
  light(30, 20);
  light(31, 20);
  EXPECT_TRUE(noise_mask(image).box.empty());
  light(30, 21);
  light(31, 21);
  EXPECT_EQ(noise_mask(image).box.x0, 30);
  EXPECT_EQ(noise_mask(image).box.y1, 22);
}

}  // namespace
}  // namespace emberlock::recon
