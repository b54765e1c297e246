// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/dark_part.h"

#include <algorithm>
#include <cmath>

#include "recon/preprocess/radiance.h"

namespace emberlock::recon {
namespace {

constexpr int kEdge = 8;  // pixels
constexpr double kLeast = 0.5;

std::vector<double> block_means(const Samples& of) {
  std::vector<double> blocks;
  const int across = kEdge * of.channels();
  for (int y = 0; y + kEdge <= of.size.height; y += kEdge) {
    for (int x = 0; x + kEdge <= of.size.width; x += kEdge) {
      double sum = 0;
      for (int v = 0; v < kEdge; ++v) {
        const std::size_t row = of.index(x, y + v);
        for (int i = 0; i < across; ++i)
          sum += static_cast<double>(of.value[row + static_cast<std::size_t>(i)]);
      }
      blocks.push_back(sum / (kEdge * across));
    }
  }
  return blocks;
}

/// The sum of the blocks above their median: the light that exceeds the background.
double light_of(std::vector<double> blocks) {
  if (blocks.empty()) return 0;
  const auto middle = blocks.begin() + static_cast<std::ptrdiff_t>(blocks.size() / 2);
  std::nth_element(blocks.begin(), middle, blocks.end());
  const double level = *middle;
  double light = 0;
  for (const double block : blocks) light += std::max(0.0, block - level);
  return light;
}

/// Standard deviation of a block's mean, from the scatter of differences between neighbouring samples.
double block_sigma(const Samples& from, const Samples& to) {
  std::vector<double> scatter;
  constexpr std::size_t kStep = 5;
  const auto beside = static_cast<std::size_t>(from.pitch()) * static_cast<std::size_t>(from.channels());
  for (std::size_t i = 0; i + beside < from.value.size(); i += kStep) {
    const double here = static_cast<double>(to.value[i]) - static_cast<double>(from.value[i]);
    const double next =
        static_cast<double>(to.value[i + beside]) - static_cast<double>(from.value[i + beside]);
    scatter.push_back(std::abs(next - here));
  }
  if (scatter.empty()) return 0;
  const auto middle = scatter.begin() + static_cast<std::ptrdiff_t>(scatter.size() / 2);
  std::nth_element(scatter.begin(), middle, scatter.end());
  return 1.4826 * *middle / std::sqrt(2.0) / kEdge / std::sqrt(static_cast<double>(from.channels()));
}

}  // namespace

LightChange light_change(const Samples& from, const Samples& to) {
  if (from.size != to.size || from.layout != to.layout) return LightChange::other;
  const std::vector<double> before = block_means(from);
  const std::vector<double> after = block_means(to);
  const double limit = std::max(kLeast, 6 * block_sigma(from, to));
  double gone = 0;
  for (std::size_t i = 0; i < before.size(); ++i) {
    const double d = after[i] - before[i];
    if (d > limit) return LightChange::other;
    if (d < -limit) gone -= d;
  }
  if (gone == 0) return LightChange::none;
  return gone > 0.5 * light_of(before) ? LightChange::gone_out : LightChange::other;
}

Samples midmean_of(const std::vector<Samples>& frames) {
  Samples out = frames.front();
  std::vector<float> values(frames.size());
  for (std::size_t i = 0; i < out.value.size(); ++i) {
    for (std::size_t f = 0; f < frames.size(); ++f) values[f] = frames[f].value[i];
    out.value[i] = midmean(values);
  }
  return out;
}

void subtract(Samples& samples, const Samples& background) {
  for (std::size_t i = 0; i < samples.value.size(); ++i) samples.value[i] -= background.value[i];
}

}  // namespace emberlock::recon
