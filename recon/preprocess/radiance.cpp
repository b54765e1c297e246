#include "recon/preprocess/radiance.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock {
namespace {

/// Channel (0 R, 1 G, 2 B) that an RGGB mosaic measures at a pixel.
constexpr int bayer_channel(int x, int y) { return (x & 1) + (y & 1); }

/// Bilinear interpolation written as a normalised convolution with (1 2 1) x (1 2 1) over the samples of one
/// channel: the same weights inside, and at the border the neighbours that exist share them.
float demosaic(const ImageView& image, int x, int y, int channel) {
  if (bayer_channel(x, y) == channel) return static_cast<float>(image.sample(x, y));
  int sum = 0;
  int weights = 0;
  for (int v = std::max(0, y - 1); v <= std::min(image.height() - 1, y + 1); ++v) {
    for (int u = std::max(0, x - 1); u <= std::min(image.width() - 1, x + 1); ++u) {
      if (bayer_channel(u, v) != channel) continue;
      const int weight = (u == x ? 2 : 1) * (v == y ? 2 : 1);
      sum += weight * image.sample(u, v);
      weights += weight;
    }
  }
  return weights == 0 ? 0.0F : static_cast<float>(sum) / static_cast<float>(weights);
}

}  // namespace

RadianceImage to_radiance(const ImageView& image) {
  RadianceImage radiance(image.layout.size);
  const float scale = 255.0F / static_cast<float>(image.layout.white());
  const bool bayer = is_bayer(image.layout.format);
  const bool colour = channels(image.layout.format) == 3;
  float* out = radiance.rgb.data();
  for (int y = 0; y < image.height(); ++y) {
    for (int x = 0; x < image.width(); ++x) {
      for (int c = 0; c < 3; ++c) {
        *out++ = scale *
                 (bayer ? demosaic(image, x, y, c) : static_cast<float>(image.sample(x, y, colour ? c : 0)));
      }
    }
  }
  return radiance;
}

void subtract_background(RadianceImage& image) {
  const std::size_t pixels = image.rgb.size() / 3;
  if (pixels == 0) return;
  const auto brightness = [&](std::size_t p) {
    return std::max({image.rgb[3 * p], image.rgb[3 * p + 1], image.rgb[3 * p + 2]});
  };
  const auto median = [](std::vector<float>& values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  std::vector<float> values(pixels);
  for (std::size_t p = 0; p < pixels; ++p) values[p] = brightness(p);
  const float limit = median(values);
  std::array<float, 3> level = {};
  for (std::size_t c = 0; c < 3; ++c) {
    values.clear();
    for (std::size_t p = 0; p < pixels; ++p)
      if (brightness(p) <= limit) values.push_back(image.rgb[3 * p + c]);
    level[c] = median(values);
  }
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] -= level[i % 3];
}

Image to_rgb8(const RadianceImage& image) {
  Image out(ImageLayout{image.size, PixelFormat::rgb8, 8});
  const auto row_samples = std::size_t{3} * static_cast<std::size_t>(image.size.width);
  for (int y = 0; y < image.size.height; ++y) {
    const float* from = image.rgb.data() + static_cast<std::size_t>(y) * row_samples;
    auto* to = out.row_as<std::uint8_t>(y);
    for (std::size_t i = 0; i < row_samples; ++i) {
      const float value = std::isnan(from[i]) ? 0.0F : std::clamp(from[i], 0.0F, 255.0F);
      to[i] = static_cast<std::uint8_t>(std::lround(value));
    }
  }
  return out;
}

}  // namespace emberlock
