#include "recon/preprocess/dark_part.h"

#include <algorithm>
#include <cmath>

#include "recon/preprocess/radiance.h"

namespace emberlock {
namespace {

constexpr int kEdge = 8;  // pixels
constexpr double kLeast = 0.5;

std::vector<double> block_differences(const Samples& from, const Samples& to) {
  std::vector<double> blocks;
  const int across = kEdge * from.channels();
  for (int y = 0; y + kEdge <= from.size.height; y += kEdge) {
    for (int x = 0; x + kEdge <= from.size.width; x += kEdge) {
      double sum = 0;
      for (int v = 0; v < kEdge; ++v) {
        const std::size_t row = from.index(x, y + v);
        for (int i = 0; i < across; ++i) {
          const std::size_t at = row + static_cast<std::size_t>(i);
          sum += static_cast<double>(to.value[at]) - static_cast<double>(from.value[at]);
        }
      }
      blocks.push_back(sum / (kEdge * across));
    }
  }
  return blocks;
}

/// Of a block's mean, from how neighbouring samples' differences scatter.
double block_sigma(const Samples& from, const Samples& to) {
  std::vector<double> scatter;
  constexpr std::size_t kStep = 5;
  const auto beside = static_cast<std::size_t>(from.pitch() * from.channels());
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
  const std::vector<double> blocks = block_differences(from, to);
  const double limit = std::max(kLeast, 6 * block_sigma(from, to));
  bool dimmer = false;
  for (const double d : blocks) {
    if (d > limit) return LightChange::other;
    dimmer = dimmer || d < -limit;
  }
  return dimmer ? LightChange::dimmer : LightChange::none;
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

}  // namespace emberlock
