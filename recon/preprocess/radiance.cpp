// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/radiance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "recon/preprocess/samples.h"

namespace emberlock::recon {

RadianceImage to_radiance(const ImageView& image) { return to_picture(samples_of(image)); }

float midmean(std::vector<float>& values) {
  const std::size_t quarter = (values.size() - 1) / 4;
  const auto first = values.begin() + static_cast<std::ptrdiff_t>(quarter);
  const auto last = values.end() - static_cast<std::ptrdiff_t>(quarter);
  std::nth_element(values.begin(), first, values.end());
  std::nth_element(first, last - 1, values.end());
  double sum = 0;
  for (auto v = first; v < last; ++v) sum += static_cast<double>(*v);
  return static_cast<float>(sum / static_cast<double>(last - first));
}

std::array<float, 3> subtract_background(RadianceImage& image) {
  // Block means decide which half is darker, because noise doesn't sort them. The level is the midmean of
  // pixels: unlike the mean it isn't biased by clipping at black, and unlike the median it isn't limited to
  // sample values.
  constexpr int kBlocks = 12;  // at least, along the shorter side
  constexpr int kLargest = 8;
  const int edge = std::clamp(std::min(image.size.width, image.size.height) / kBlocks, 1, kLargest);
  const auto each_pixel = [&](int x, int y, const auto& act) {
    for (int v = y; v < y + edge; ++v) {
      const int first = v * image.size.width + x;
      const float* rgb = &image.rgb[3 * static_cast<std::size_t>(first)];
      for (int u = 0; u < edge; ++u, rgb += 3) act(rgb);
    }
  };
  struct Block {
    int x, y;
    float brightness;
  };
  std::vector<Block> blocks;
  for (int y = 0; y + edge <= image.size.height; y += edge) {
    for (int x = 0; x + edge <= image.size.width; x += edge) {
      std::array<float, 3> sum = {};
      each_pixel(x, y, [&](const float* rgb) {
        for (std::size_t c = 0; c < 3; ++c) sum[c] += rgb[c];
      });
      blocks.push_back({x, y, std::max({sum[0], sum[1], sum[2]})});
    }
  }
  if (blocks.empty()) return {};
  const auto half = blocks.begin() + static_cast<std::ptrdiff_t>(blocks.size() / 2);
  std::nth_element(blocks.begin(), half, blocks.end(),
                   [](const Block& a, const Block& b) { return a.brightness < b.brightness; });
  std::array<float, 3> level = {};
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<float> values;
    for (auto block = blocks.begin(); block <= half; ++block)
      each_pixel(block->x, block->y, [&](const float* rgb) { values.push_back(rgb[c]); });
    level[c] = midmean(values);
  }
  for (std::size_t i = 0; i < image.rgb.size(); i += 3)
    for (std::size_t c = 0; c < 3; ++c) image.rgb[i + c] -= level[c];
  return level;
}

Image to_rgb8(const RadianceImage& image) {
  Image out(ImageLayout{image.size, PixelFormat::rgb8, 8});
  const auto row_samples = std::size_t{3} * static_cast<std::size_t>(image.size.width);
  for (int y = 0; y < image.size.height; ++y) {
    const float* from = image.rgb.data() + static_cast<std::size_t>(y) * row_samples;
    auto* to = out.row_as<std::uint8_t>(y);
    for (std::size_t i = 0; i < row_samples; ++i) {
      // In double, adding a half and cutting rounds as lround() does. Comparisons with NaN are false: 0.
      const float value = from[i] > 0.0F ? std::min(from[i], 255.0F) : 0.0F;
      const double rounded = static_cast<double>(value) + 0.5;
      to[i] = static_cast<std::uint8_t>(rounded);
    }
  }
  return out;
}

}  // namespace emberlock::recon
