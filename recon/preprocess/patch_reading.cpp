// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/patch_reading.h"

#include <algorithm>
#include <cmath>

#include "recon/preprocess/dark_part.h"
#include "recon/preprocess/hot_pixels.h"
#include "recon/preprocess/samples.h"

namespace emberlock::recon {
namespace {

constexpr const char* kFlatPrefix = "flat:";
constexpr int kFlatBlocks = 12;  // along each side, as patches
constexpr int kFlatCells = 48;   // along a row, as a field
constexpr int kLeastFlatCell = 16;
constexpr double kDarkest = 0.03;  // samples: below, noise and quantisation bias the mean
constexpr double kBrightest = 0.985;

struct ChannelSamples {
  std::vector<int> value;
  int saturated = 0;
};

PatchReading summarise(const std::array<ChannelSamples, 3>& samples, int white) {
  PatchReading out;
  for (std::size_t c = 0; c < 3; ++c) {
    std::vector<int> v = samples[c].value;
    if (v.empty()) continue;
    std::sort(v.begin(), v.end());
    const int median = v[v.size() / 2];
    std::vector<int> off(v.size());
    std::transform(v.begin(), v.end(), off.begin(), [&](int x) { return std::abs(x - median); });
    std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
    const double limit = std::max(2.5, 5 * 1.4826 * (off[off.size() / 2] + 0.5));
    double sum = 0;
    double squares = 0;
    for (const int x : v) {
      if (std::abs(x - median) > limit) continue;
      sum += x;
      squares += static_cast<double>(x) * x;
      ++out.count[c];
    }
    const double mean = sum / out.count[c];
    out.mean[c] = mean / white;
    out.variance[c] =
        std::max(0.0, squares / out.count[c] - mean * mean) / (static_cast<double>(white) * white);
    out.saturated[c] = samples[c].saturated / static_cast<double>(v.size());
  }
  return out;
}

}  // namespace

PatchReading read_patch(const ImageView& picture, const PatchPlace& place) {
  std::array<ChannelSamples, 3> samples;
  const int white = picture.layout.white();
  const bool mosaic = is_bayer(picture.layout.format);
  const int channels = emberlock::channels(picture.layout.format);
  for (int y = place.y; y < place.y + place.height; ++y) {
    for (int x = place.x; x < place.x + place.width; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (mosaic && mosaic_channel(x, y) != c) continue;
        const int value = picture.sample(x, y, channels == 3 ? c : 0);
        ChannelSamples& into = samples[static_cast<std::size_t>(c)];
        into.value.push_back(value);
        if (value >= white) ++into.saturated;
      }
    }
  }
  PatchReading out = summarise(samples, white);
  out.x = place.x + 0.5 * place.width;
  out.y = place.y + 0.5 * place.height;
  return out;
}

FlatReading read_flat(const ImageView& picture) {
  const ImageSize size = picture.layout.size;
  const int side = std::max(kLeastFlatCell, size.width / kFlatCells);
  FlatReading flat{0, size, std::max(1, size.width / side), std::max(1, size.height / side), {}};
  for (int row = 0; row < flat.rows; ++row) {
    const int y = row * size.height / flat.rows;
    for (int column = 0; column < flat.columns; ++column) {
      const int x = column * size.width / flat.columns;
      flat.cells.push_back(read_patch(picture, {x, y, (column + 1) * size.width / flat.columns - x,
                                                (row + 1) * size.height / flat.rows - y}));
    }
  }
  return flat;
}

std::vector<PatchReading> flat_patches(const ImageView& picture, const std::string& name) {
  const ImageSize size = picture.layout.size;
  const int width = std::max(2, size.width / kFlatBlocks);
  const int height = std::max(2, size.height / kFlatBlocks);
  std::vector<PatchReading> patches;
  for (int y = 0; y + height <= size.height; y += height)
    for (int x = 0; x + width <= size.width; x += width) {
      patches.push_back(read_patch(picture, {x, y, width, height}));
      patches.back().patch = kFlatPrefix + name;
    }
  return patches;
}

bool is_flat(const PatchReading& reading) { return reading.patch.rfind(kFlatPrefix, 0) == 0; }

DarkReading read_dark(const std::vector<Image>& pictures) {
  DarkReading dark;
  std::vector<Samples> frames;
  frames.reserve(pictures.size());
  for (const Image& picture : pictures) frames.push_back(samples_of(picture.view()));
  dark.hot_pixels = hot_pixels_of_dark(midmean_of(frames));
  for (auto& histogram : dark.histogram) histogram.assign(256, 0);
  std::array<double, 3> count = {};
  for (const Samples& s : frames) {
    const auto channels = static_cast<std::size_t>(s.channels());
    for (std::size_t i = 0; i < s.value.size(); ++i) {
      const auto pixel = i / channels;
      const auto x = static_cast<int>(pixel % static_cast<std::size_t>(s.size.width));
      const auto y = static_cast<int>(pixel / static_cast<std::size_t>(s.size.width));
      const auto bin = static_cast<std::size_t>(std::clamp(std::lround(s.value[i]), 0L, 255L));
      for (std::size_t c = 0; c < 3; ++c) {
        const bool sees = s.layout == SampleLayout::grey || (s.layout == SampleLayout::rgb && i % 3 == c) ||
                          (s.layout == SampleLayout::mosaic && mosaic_channel(x, y) == static_cast<int>(c));
        if (!sees) continue;
        dark.histogram[c][bin] += 1;
        count[c] += 1;
      }
    }
  }
  for (std::size_t c = 0; c < 3; ++c)
    for (double& share : dark.histogram[c]) share /= std::max(1.0, count[c]);
  return dark;
}

double dark_sample(const DarkReading& dark, std::size_t channel) {
  const std::vector<double>& shares = dark.histogram[channel];
  double below = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (below + shares[i] >= 0.5)
      return std::max(0.0, (static_cast<double>(i) - 0.5 + (0.5 - below) / shares[i]) / 255);
    below += shares[i];
  }
  return 0;
}

double mean_sigma(const PatchReading& reading, std::size_t channel, double step) {
  const double spread = std::sqrt(reading.variance[channel]);
  // Noise of half a step turns quantisation into noise; without it the whole patch has the same rounding
  // error.
  const double rounding = spread > 0.4 * step ? 0 : step / std::sqrt(12.0);
  return std::hypot(spread / std::sqrt(static_cast<double>(reading.count[channel])), rounding);
}

ReadingUse use_of(const PatchReading& reading, std::size_t channel, double dark) {
  // A single clipped sample biases a patch's mean.
  if (reading.saturated[channel] > 0 || reading.mean[channel] > kBrightest) return ReadingUse::saturated;
  if (reading.mean[channel] < std::max(kDarkest, 1.5 * dark) ||
      std::sqrt(reading.variance[channel]) > 0.3 * reading.mean[channel])
    return ReadingUse::dark;
  return ReadingUse::used;
}

}  // namespace emberlock::recon
