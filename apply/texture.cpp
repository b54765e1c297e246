// SPDX-License-Identifier: Apache-2.0
#include "apply/texture.h"

#include <algorithm>
#include <cmath>

namespace emberlock::apply {
namespace {

/// Linear light of each level.
const std::array<float, 256>& srgb_levels() {
  static const std::array<float, 256> levels = [] {
    std::array<float, 256> all{};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double level = static_cast<double>(i) / 255;
      all[i] = static_cast<float>(level <= 0.04045 ? level / 12.92 : std::pow((level + 0.055) / 1.055, 2.4));
    }
    return all;
  }();
  return levels;
}

int wrapped(int i, int size, Texture::Wrap wrap) {
  if (wrap == Texture::Wrap::clamp) return std::clamp(i, 0, size - 1);
  const int period = wrap == Texture::Wrap::mirror ? 2 * size : size;
  const int within = (i % period + period) % period;
  return within < size ? within : period - 1 - within;
}

}  // namespace

std::array<float, 3> Texture::at(float u, float v) const {
  constexpr float kFar = 1000;  // times a texture over: beyond, floats tell no texel apart
  const float x = std::clamp(u, -kFar, kFar) * static_cast<float>(width) - 0.5F;
  const float y = std::clamp(v, -kFar, kFar) * static_cast<float>(height) - 0.5F;
  const auto left = static_cast<int>(std::floor(x));
  const auto top = static_cast<int>(std::floor(y));
  std::array<float, 3> sum{};
  for (int corner = 0; corner < 4; ++corner) {
    const int dx = corner & 1;
    const int dy = corner >> 1;
    const float fx = x - static_cast<float>(left);
    const float fy = y - static_cast<float>(top);
    const float weight = (dx != 0 ? fx : 1 - fx) * (dy != 0 ? fy : 1 - fy);
    const auto row = static_cast<std::size_t>(wrapped(top + dy, height, down));
    const auto column = static_cast<std::size_t>(wrapped(left + dx, width, across));
    const std::uint8_t* texel = &rgb[3 * (row * static_cast<std::size_t>(width) + column)];
    for (std::size_t c = 0; c < 3; ++c) sum[c] += weight * srgb_levels()[texel[c]];
  }
  return sum;
}

}  // namespace emberlock::apply
