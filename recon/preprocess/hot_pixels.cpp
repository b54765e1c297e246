// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/hot_pixels.h"

#include <algorithm>
#include <cmath>

namespace emberlock::recon {
namespace {

constexpr double kHotSigmas = 6;
constexpr float kLeastSigma = 1.0F / 3;  // grey levels: quantisation alone

float difference_at(const Samples& s, int x, int y, int c) {
  return s.value[s.index(x, y, c)] - neighbours_of(s.view(), x, y, c).median();
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
    Neighbours around = neighbours_of(dark.view(), x, y, c);
    if (around.count < 2) return false;
    around.sort();
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
    const Neighbours around = neighbours_of(picture.view(), x, y, c);
    const auto [low, high] = std::minmax_element(around.value, around.value + around.count);
    return value - *high > limit + (*high - *low);
  });
}

void replace_hot_pixels(Samples& samples, const std::vector<std::uint32_t>& pixels) {
  const ReplaceHotPixel replace{samples.view(),
                                {pixels.data(), pixels.size()},
                                samples.value.data(),
                                samples.saturated.empty() ? nullptr : samples.saturated.data()};
  for (std::size_t i = 0; i < pixels.size(); ++i) replace(i);
}

}  // namespace emberlock::recon
