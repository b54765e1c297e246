// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "recon/compute/cuda_launch.h"
#include "recon/hull/hull_cuda.h"

namespace emberlock::recon {

void carve_on_cuda(const Grid& grid, std::vector<Silhouette> views,
                   const std::vector<const FlameMask*>& masks, std::vector<std::uint8_t>& inside) {
  std::vector<std::uint8_t> pixels;  // of all views that aren't there yet, for a single copy
  std::size_t corners = 0;
  std::size_t rows = 0;
  std::size_t columns = 0;
  for (std::size_t v = 0; v < views.size(); ++v) {
    const auto width = static_cast<std::size_t>(views[v].width);
    const auto height = static_cast<std::size_t>(views[v].height);
    if (!masks[v]->on_gpu) pixels.insert(pixels.end(), masks[v]->flame.begin(), masks[v]->flame.end());
    corners += (width + 1) * (height + 1);
    rows = std::max(rows, height);
    columns = std::max(columns, width + 1);
  }
  const CudaBuffer<std::uint8_t> flame(pixels);
  const CudaBuffer<std::uint32_t> sums(corners);
  std::vector<FlameTable> tables;
  const std::uint8_t* pixel = flame.data();
  std::uint32_t* sum = sums.data();
  for (std::size_t v = 0; v < views.size(); ++v) {
    Silhouette& view = views[v];
    const bool there = masks[v]->on_gpu != nullptr;
    tables.push_back({there ? masks[v]->on_gpu.get() : pixel, sum, view.width, view.height});
    view.flame_pixels = sum;
    if (!there) pixel += masks[v]->flame.size();
    sum += static_cast<std::size_t>(view.width + 1) * static_cast<std::size_t>(view.height + 1);
  }
  const CudaBuffer<FlameTable> table(tables);
  launch(rows * views.size(), SumAlongRow{table.data(), rows}, "summing masks along rows");
  launch(columns * views.size(), SumDownColumns{table.data(), columns, 1}, "summing masks down columns");
  const CudaBuffer<Silhouette> silhouettes(views);
  const auto carved = CudaBuffer<std::uint8_t>::unfilled(inside.size());
  launch(inside.size(),
         CarveVoxel{{{grid}, silhouettes.data(), static_cast<int>(views.size())}, carved.data()}, "carving");
  carved.download(inside.data());
}

}  // namespace emberlock::recon
