#include "recon/preprocess/radiance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "recon/preprocess/samples.h"

namespace emberlock {
RadianceImage to_radiance(const ImageView& image) { return to_picture(samples_of(image)); }

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
