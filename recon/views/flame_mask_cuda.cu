// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <memory>

#include "recon/compute/cuda_launch.h"
#include "recon/kernels/flame.h"
#include "recon/views/flame_mask_cuda.h"
#include "recon/views/picture_on_gpu.h"

namespace emberlock::recon {
namespace {

PixelBox box_of(const RowOfFlame* rows, int height) {
  PixelBox box;
  for (int y = 0; y < height; ++y) {
    const RowOfFlame& row = rows[y];
    if (row.last == 0) continue;
    if (box.empty()) box = {row.first, y, row.last, y + 1};
    box = {std::min(box.x0, row.first), box.y0, std::max(box.x1, row.last), y + 1};
  }
  return box;
}

}  // namespace

std::vector<FlameMask> masks_on_cuda(const std::vector<SharedImage>& images,
                                     std::optional<double> threshold) {
  const std::size_t count = images.size();
  std::vector<FlameMask> masks(count);
  std::vector<FlameView> views(count);
  std::vector<std::shared_ptr<const CudaBuffer<float>>> pictures;
  std::size_t pixels = 0;  // of all views
  std::size_t most_pixels = 1;
  std::size_t most_rows = 1;
  std::size_t most_blocks = 1;
  std::vector<std::size_t> first(count);
  for (std::size_t v = 0; v < count; ++v) {
    const SharedImage& image = images[v];
    const ImageSize size = image->size;
    const NoiseBlocks blocks = noise_blocks(size);
    pictures.push_back(on_gpu(image));
    views[v] = {pictures.back()->data(), nullptr,      size.width, size.height,          blocks.edge,
                blocks.across,           blocks.count, 0,          threshold.has_value()};
    first[v] = pixels;
    const std::size_t here = image->rgb.size() / 3;
    pixels += here;
    most_pixels = std::max(most_pixels, here);
    most_rows = std::max(most_rows, static_cast<std::size_t>(size.height));
    most_blocks = std::max(most_blocks, static_cast<std::size_t>(blocks.count));
  }
  const auto flame =
      std::make_shared<const CudaBuffer<std::uint8_t>>(CudaBuffer<std::uint8_t>::unfilled(pixels));
  for (std::size_t v = 0; v < count; ++v) views[v].flame = flame->data() + first[v];
  std::vector<BlockStatistics> measured;
  if (!threshold) {
    const CudaBuffer<FlameView> table(views);
    const auto to = CudaBuffer<BlockStatistics>::unfilled(count * most_blocks);
    launch(to.size(), MeasureBlock{table.data(), most_blocks, to.data()}, "measuring noise");
    measured = to.download();
  }
  for (std::size_t v = 0; v < count; ++v) {
    NoiseThreshold found;
    if (threshold) {
      found = {*threshold, not_above(*threshold)};
    } else {
      const NoiseBlocks blocks = noise_blocks(images[v]->size);
      std::vector<double> means;
      std::vector<float> peaks;
      for (std::size_t b = 0; b < static_cast<std::size_t>(blocks.count); ++b) {
        means.push_back(measured[v * most_blocks + b].mean);
        peaks.push_back(measured[v * most_blocks + b].peak);
      }
      found = noise_threshold(blocks, means, peaks);
    }
    views[v].least = found.least;
    masks[v].threshold = found.value;
  }
  const CudaBuffer<FlameView> table(views);
  const auto rows = CudaBuffer<RowOfFlame>::unfilled(count * most_rows);
  launch(count * most_pixels, MaskPixel{table.data(), most_pixels}, "masking flames");
  launch(rows.size(), FindRow{table.data(), most_rows, rows.data()}, "finding flames");
  const std::vector<RowOfFlame> found = rows.download();
  const std::vector<std::uint8_t> all = flame->download();
  for (std::size_t v = 0; v < count; ++v) {
    FlameMask& mask = masks[v];
    mask.size = images[v]->size;
    const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first[v]);
    mask.flame.assign(begin, begin + static_cast<std::ptrdiff_t>(images[v]->rgb.size() / 3));
    mask.box = box_of(&found[v * most_rows], mask.size.height);
    mask.on_gpu = std::shared_ptr<const std::uint8_t>(flame, flame->data() + first[v]);
  }
  return masks;
}

}  // namespace emberlock::recon
