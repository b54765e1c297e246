// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/flame_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emberlock::recon {
namespace {

float brightness(const float* rgb) { return std::max({rgb[0], rgb[1], rgb[2]}); }

template <class Values>
double median(Values& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

double noise_threshold(const RadianceImage& image) {
  constexpr int kBlocks = 12;  // along the shorter side, where pixels allow
  const int edge = std::clamp(std::min(image.size.width, image.size.height) / kBlocks, 4, 16);
  std::vector<double> means;
  std::vector<double> peaks;
  for (int y = 0; y + edge <= image.size.height; y += edge) {
    for (int x = 0; x + edge <= image.size.width; x += edge) {
      double sum = 0;
      double peak = -std::numeric_limits<double>::infinity();
      for (int i = 0; i < edge * edge; ++i) {
        const std::size_t p =
            static_cast<std::size_t>(y + i / edge) * static_cast<std::size_t>(image.size.width) +
            static_cast<std::size_t>(x + i % edge);
        const auto v = static_cast<double>(brightness(&image.rgb[3 * p]));
        sum += v;
        peak = std::max(peak, v);
      }
      means.push_back(sum / (edge * edge));
      peaks.push_back(peak);
    }
  }
  if (means.empty()) return 1;
  // The brightest of n normal pixels lies about sqrt(2 ln n) - 1/2 sigma above their mean. Looking at the
  // brightest ones needs no model of what clipping at black, quantisation and demosaicing do to the rest.
  const double background = median(means);
  const double above = std::sqrt(2 * std::log(edge * edge)) - 0.5;
  return background + std::max(1.0, 6 / above * (median(peaks) - background));
}

FlameMask flame_mask(const RadianceImage& image, double threshold) {
  FlameMask mask;
  mask.size = image.size;
  mask.threshold = threshold;
  mask.flame.resize(image.rgb.size() / 3);
  PixelBox box{image.size.width, image.size.height, 0, 0};
  for (int y = 0; y < image.size.height; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.size.width);
    for (int x = 0; x < image.size.width; ++x) {
      const std::size_t p = row + static_cast<std::size_t>(x);
      if (!(brightness(&image.rgb[3 * p]) > threshold)) continue;
      mask.flame[p] = 1;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  mask.box = box.empty() ? PixelBox{} : box;
  return mask;
}

FlameMask noise_mask(const RadianceImage& image) {
  const FlameMask raw = flame_mask(image, noise_threshold(image));
  constexpr int kNeighbours = 3;
  const auto lit = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < raw.size.width && y < raw.size.height && raw.at(x, y);
  };
  FlameMask mask{raw.size, raw.threshold, std::vector<std::uint8_t>(raw.flame.size()), {}};
  PixelBox box{raw.size.width, raw.size.height, 0, 0};
  for (int y = raw.box.y0; y < raw.box.y1; ++y) {
    for (int x = raw.box.x0; x < raw.box.x1; ++x) {
      if (!raw.at(x, y)) continue;
      int around = -1;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) around += lit(x + dx, y + dy) ? 1 : 0;
      if (around < kNeighbours) continue;
      mask.flame[static_cast<std::size_t>(y) * static_cast<std::size_t>(raw.size.width) +
                 static_cast<std::size_t>(x)] = 1;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  mask.box = box.empty() ? PixelBox{} : box;
  return mask;
}

std::vector<FlameMask> flame_masks(const Scene& scene, std::optional<double> threshold) {
  std::vector<FlameMask> masks;
  masks.reserve(scene.views.size());
  for (const View& view : scene.views)
    masks.push_back(threshold ? flame_mask(*view.image, *threshold) : noise_mask(*view.image));
  return masks;
}

}  // namespace emberlock::recon
