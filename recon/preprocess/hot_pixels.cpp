// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/hot_pixels.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace emberlock::recon {
namespace {

constexpr double kHotSigmas = 6;
constexpr float kLeastSigma = 1.0F / 3;  // grey levels: quantisation alone

/// A sample's neighbours of the same colour, up to eight.
struct Neighbours {
  std::array<float, 8> value = {};
  std::array<std::size_t, 8> at = {};
  std::size_t count = 0;
  void add(float v, std::size_t index) {
    value[count] = v;
    at[count++] = index;
  }
  [[nodiscard]] float median() {
    if (count == 0) return 0;
    std::sort(value.begin(), value.begin() + static_cast<std::ptrdiff_t>(count));
    return 0.5F * (value[(count - 1) / 2] + value[count / 2]);
  }
};

/// In a mosaic they are two pixels away, also for green, so that all colours are treated alike.
template <class Skip>
Neighbours neighbours_of(const Samples& s, int x, int y, int c, const Skip& skip) {
  Neighbours out;
  const int pitch = s.pitch();
  for (int v = y - pitch; v <= y + pitch; v += pitch) {
    for (int u = x - pitch; u <= x + pitch; u += pitch) {
      const bool inside = u >= 0 && v >= 0 && u < s.size.width && v < s.size.height;
      if (!inside || (u == x && v == y) || skip(u, v)) continue;
      out.add(s.value[s.index(u, v, c)], s.index(u, v, c));
    }
  }
  return out;
}

constexpr auto kNone = [](int, int) { return false; };

float difference_at(const Samples& s, int x, int y, int c) {
  return s.value[s.index(x, y, c)] - neighbours_of(s, x, y, c, kNone).median();
}

/// Six times the spread of samples around their neighbours' median, from about 20 000 of them.
float six_sigma(const Samples& s) {
  constexpr double kEnough = 20000;
  const int step = 1 + 2 * static_cast<int>(std::sqrt(static_cast<double>(s.value.size()) / kEnough) /
                                            2);  // odd, to include all phases of a mosaic
  std::vector<float> values;
  for (int y = 0; y < s.size.height; y += step)
    for (int x = 0; x < s.size.width; x += step)
      for (int c = 0; c < s.channels(); ++c) values.push_back(std::abs(difference_at(s, x, y, c)));
  if (values.empty()) return static_cast<float>(kHotSigmas) * kLeastSigma;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return static_cast<float>(kHotSigmas) * std::max(kLeastSigma, 1.4826F * *middle);
}

template <class IsHot>
std::vector<std::uint32_t> pixels_where(const Samples& s, const IsHot& is_hot) {
  std::vector<std::uint32_t> pixels;
  for (int y = 0; y < s.size.height; ++y) {
    for (int x = 0; x < s.size.width; ++x) {
      bool hot = false;
      for (int c = 0; c < s.channels() && !hot; ++c) hot = is_hot(x, y, c);
      if (hot) pixels.push_back(static_cast<std::uint32_t>(y * s.size.width + x));
    }
  }
  return pixels;
}

}  // namespace

std::vector<std::uint32_t> hot_pixels_of_dark(const Samples& dark) {
  const float limit = six_sigma(dark);
  return pixels_where(dark, [&](int x, int y, int c) {
    Neighbours around = neighbours_of(dark, x, y, c, kNone);
    if (around.count < 2) return false;
    (void)around.median();  // sorts
    return dark.value[dark.index(x, y, c)] - around.value[around.count - 2] > limit;
  });
}

std::vector<std::uint32_t> hot_pixels_of_picture(const Samples& picture) {
  const float limit = six_sigma(picture);
  const int pitch = picture.pitch();
  return pixels_where(picture, [&](int x, int y, int c) {
    const float value = picture.value[picture.index(x, y, c)];
    // Most pixels end here.
    const int beside = x >= pitch ? x - pitch : x + pitch;
    if (beside >= picture.size.width || !(value - picture.value[picture.index(beside, y, c)] > limit))
      return false;
    const Neighbours around = neighbours_of(picture, x, y, c, kNone);
    const auto last = around.value.begin() + static_cast<std::ptrdiff_t>(around.count);
    const auto [low, high] = std::minmax_element(around.value.begin(), last);
    return value - *high > limit + (*high - *low);
  });
}

void replace_hot_pixels(Samples& samples, const std::vector<std::uint32_t>& pixels) {
  const auto listed = [&](int x, int y) {
    return std::binary_search(pixels.begin(), pixels.end(),
                              static_cast<std::uint32_t>(y * samples.size.width + x));
  };
  for (const std::uint32_t pixel : pixels) {
    const int x = static_cast<int>(pixel) % samples.size.width;
    const int y = static_cast<int>(pixel) / samples.size.width;
    for (int c = 0; c < samples.channels(); ++c) {
      Neighbours around = neighbours_of(samples, x, y, c, listed);
      if (around.count == 0) continue;
      if (!samples.saturated.empty()) {
        std::size_t saturated = 0;
        for (std::size_t i = 0; i < around.count; ++i) saturated += samples.saturated[around.at[i]];
        samples.saturated[samples.index(x, y, c)] = 2 * saturated > around.count ? 1 : 0;
      }
      samples.value[samples.index(x, y, c)] = around.median();
    }
  }
}

}  // namespace emberlock::recon
