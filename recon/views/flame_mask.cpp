// SPDX-License-Identifier: Apache-2.0
#include "recon/views/flame_mask.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "recon/compute/cuda_device.h"
#include "recon/compute/pool.h"
#include "recon/views/flame_mask_cuda.h"
#include "recon/views/view.h"

namespace emberlock::recon {
namespace {

/// The brightest channel of each pixel.
std::vector<float> brightness(const RadianceImage& image) {
  std::vector<float> brightest(image.rgb.size() / 3);
  const float* rgb = image.rgb.data();
  for (std::size_t p = 0; p < brightest.size(); ++p)
    brightest[p] = std::max({rgb[3 * p], rgb[3 * p + 1], rgb[3 * p + 2]});
  return brightest;
}

std::size_t row_begin(ImageSize size, int y) {
  return static_cast<std::size_t>(y) * static_cast<std::size_t>(size.width);
}

template <class Values>
double median(Values& values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Blocks {
  std::vector<double> means;
  std::vector<float> peaks;
};

/// Of the square blocks that lie wholly in the picture.
Blocks blocks_of(const std::vector<float>& bright, ImageSize size, const NoiseBlocks& grid) {
  Blocks blocks;
  const int edge = grid.edge;
  const int across = grid.across;
  for (int y = 0; y + edge <= size.height; y += edge) {
    const std::size_t first = blocks.means.size();
    blocks.means.resize(first + static_cast<std::size_t>(across), 0);
    blocks.peaks.resize(first + static_cast<std::size_t>(across), -std::numeric_limits<float>::infinity());
    for (int dy = 0; dy < edge; ++dy) {
      const float* pixel = bright.data() + row_begin(size, y + dy);
      for (std::size_t b = first; b < blocks.means.size(); ++b) {
        double sum = blocks.means[b];
        float peak = blocks.peaks[b];
        for (int dx = 0; dx < edge; ++dx, ++pixel) {
          sum += static_cast<double>(*pixel);
          peak = std::max(peak, *pixel);
        }
        blocks.means[b] = sum;
        blocks.peaks[b] = peak;
      }
    }
  }
  for (double& mean : blocks.means) mean /= edge * edge;
  return blocks;
}

/// Removes the blocks in which a pixel is infinitely dark.
void remove_left_out(Blocks& blocks) {
  const auto left_out = [](double mean) { return std::isinf(mean); };
  for (std::size_t b = blocks.means.size(); b-- > 0;) {
    if (!left_out(blocks.means[b])) continue;
    blocks.means.erase(blocks.means.begin() + static_cast<std::ptrdiff_t>(b));
    blocks.peaks.erase(blocks.peaks.begin() + static_cast<std::ptrdiff_t>(b));
  }
}

NoiseThreshold noise_threshold(const std::vector<float>& bright, ImageSize size) {
  const NoiseBlocks grid = noise_blocks(size);
  Blocks blocks = blocks_of(bright, size, grid);
  remove_left_out(blocks);
  return noise_threshold(grid, blocks.means, blocks.peaks);
}

/// The smallest box that holds every pixel of 1.
PixelBox box_of(const std::vector<std::uint8_t>& flame, ImageSize size) {
  const auto width = static_cast<std::size_t>(size.width);
  std::vector<std::uint8_t> column(width);  // 1 where any row has one
  int y0 = size.height;
  int y1 = 0;
  for (int y = 0; y < size.height; ++y) {
    const std::uint8_t* row = flame.data() + row_begin(size, y);
    unsigned any = 0;
    for (std::size_t x = 0; x < width; ++x) {
      column[x] |= row[x];
      any |= row[x];
    }
    if (any == 0) continue;
    y0 = std::min(y0, y);
    y1 = y + 1;
  }
  if (y1 == 0) return {};
  const auto x0 = std::find(column.begin(), column.end(), 1) - column.begin();
  const auto x1 = column.rend() - std::find(column.rbegin(), column.rend(), 1);
  return {static_cast<int>(x0), y0, static_cast<int>(x1), y1};
}

FlameMask mask_above(const std::vector<float>& bright, ImageSize size, double threshold) {
  FlameMask mask{size, threshold, std::vector<std::uint8_t>(bright.size()), {}};
  const float least = not_above(threshold);
  for (std::size_t p = 0; p < bright.size(); ++p) mask.flame[p] = bright[p] > least ? 1 : 0;
  mask.box = box_of(mask.flame, size);
  return mask;
}

/// Leaves the flame pixels that have at least three others among their eight neighbours.
void take_out_specks(FlameMask& mask) {
  constexpr int kNeighbours = 3;
  const auto width = static_cast<std::size_t>(mask.size.width);
  const std::vector<std::uint8_t> raw = mask.flame;
  const std::vector<std::uint8_t> none(width);
  std::vector<std::uint8_t> column(width + 2);  // sums of three rows, between two of nothing
  for (int y = mask.box.y0; y < mask.box.y1; ++y) {
    const std::uint8_t* middle = raw.data() + row_begin(mask.size, y);
    const std::uint8_t* above = y > 0 ? middle - width : none.data();
    const std::uint8_t* below = y + 1 < mask.size.height ? middle + width : none.data();
    std::uint8_t* left = mask.flame.data() + row_begin(mask.size, y);
    for (std::size_t x = 0; x < width; ++x)
      column[x + 1] = static_cast<std::uint8_t>(above[x] + middle[x] + below[x]);
    for (std::size_t x = 0; x < width; ++x)
      left[x] = column[x] + column[x + 1] + column[x + 2] > kNeighbours ? middle[x] : std::uint8_t{0};
  }
  mask.box = box_of(mask.flame, mask.size);
}

/// Adds to the mask the pixels that are left out, and to its box those of them that flame may continue
/// behind: that touch it, directly or by others.
void add_left_out(FlameMask& mask, const std::vector<std::uint8_t>& marks) {
  const int width = mask.size.width;
  std::vector<std::uint8_t> continued = mask.flame;
  std::vector<int> next;
  for (std::size_t p = 0; p < continued.size(); ++p)
    if (continued[p] != 0) next.push_back(static_cast<int>(p));
  const auto look_at = [&](int x, int y) {
    if (x < 0 || y < 0 || x >= width || y >= mask.size.height) return;
    const std::size_t p = row_begin(mask.size, y) + static_cast<std::size_t>(x);
    if (continued[p] != 0 || !is_left_out(marks[p])) return;
    continued[p] = 1;
    next.push_back(static_cast<int>(p));
  };
  while (!next.empty()) {
    const int x = next.back() % width;
    const int y = next.back() / width;
    next.pop_back();
    look_at(x - 1, y);
    look_at(x + 1, y);
    look_at(x, y - 1);
    look_at(x, y + 1);
  }
  mask.box = box_of(continued, mask.size);
  for (std::size_t p = 0; p < marks.size(); ++p)
    if (is_left_out(marks[p])) mask.flame[p] = 1;
}

/// The mask of a view with pixels that are left out, which show no noise.
FlameMask mask_of_marked(const View& view, std::optional<double> threshold) {
  std::vector<float> bright = brightness(*view.image);
  for (std::size_t p = 0; p < bright.size(); ++p)
    if (is_left_out((*view.bounds)[p])) bright[p] = -std::numeric_limits<float>::infinity();
  const ImageSize size = view.image->size;
  FlameMask mask = mask_above(bright, size, threshold ? *threshold : noise_threshold(bright, size).value);
  if (!threshold) take_out_specks(mask);
  add_left_out(mask, *view.bounds);
  return mask;
}

FlameMask mask_of(const View& view, std::optional<double> threshold) {
  if (leaves_out(view)) return mask_of_marked(view, threshold);
  return threshold ? flame_mask(*view.image, *threshold) : noise_mask(*view.image);
}

}  // namespace

NoiseBlocks noise_blocks(ImageSize size) {
  constexpr int kBlocks = 12;  // along the shorter side, where pixels allow
  const int edge = std::clamp(std::min(size.width, size.height) / kBlocks, 4, 16);
  return {edge, size.width / edge, size.width / edge * (size.height / edge)};
}

NoiseThreshold noise_threshold(const NoiseBlocks& blocks, std::vector<double>& means,
                               std::vector<float>& peaks) {
  if (means.empty()) return {};
  // The brightest of n normal pixels lies about sqrt(2 ln n) - 1/2 sigma above their mean. Looking at the
  // brightest ones needs no model of what clipping at black, quantisation and demosaicing do to the rest.
  const double background = median(means);
  const double above = std::sqrt(2 * std::log(blocks.edge * blocks.edge)) - 0.5;
  const double value = background + std::max(1.0, 6 / above * (median(peaks) - background));
  return {value, not_above(value)};
}

float not_above(double value) {
  const auto nearest = static_cast<float>(value);
  return static_cast<double>(nearest) > value ? std::nextafter(nearest, -INFINITY) : nearest;
}

double noise_threshold(const RadianceImage& image) {
  return noise_threshold(brightness(image), image.size).value;
}

FlameMask flame_mask(const RadianceImage& image, double threshold) {
  return mask_above(brightness(image), image.size, threshold);
}

FlameMask noise_mask(const RadianceImage& image) {
  const std::vector<float> bright = brightness(image);
  FlameMask mask = mask_above(bright, image.size, noise_threshold(bright, image.size).value);
  take_out_specks(mask);
  return mask;
}

std::vector<FlameMask> flame_masks(const Scene& scene, std::optional<double> threshold,
                                   const ComputeOptions& compute) {
  if constexpr (kCudaBuilt) {
    const Result<Device> device = resolve(compute.device);
    // A GPU knows pictures only, not which of their pixels are left out.
    if (device.ok() && *device == Device::cuda &&
        std::none_of(scene.views.begin(), scene.views.end(), leaves_out)) {
      use_gpu(device->gpu);
      std::vector<SharedImage> pictures;
      for (const View& view : scene.views) pictures.push_back(view.image);
      return masks_on_cuda(pictures, threshold);
    }
  }
  std::vector<FlameMask> masks(scene.views.size());
  Pool pool(compute.threads);
  pool.run(static_cast<int>(masks.size()), [&](int v) {
    const auto i = static_cast<std::size_t>(v);
    masks[i] = mask_of(scene.views[i], threshold);
  });
  return masks;
}

}  // namespace emberlock::recon
