// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "base/host_device.h"

namespace emberlock::recon {

/// A view's picture, its flame mask, and the square blocks that its noise is measured in.
struct FlameView {
  const float* rgb = nullptr;     ///< 3 a pixel, row-major
  std::uint8_t* flame = nullptr;  ///< 1 or 0, one a pixel
  int width = 0, height = 0;
  int edge = 1, across = 0, blocks = 0;  ///< of a block, blocks in a row of them, and in all
  float least = 0;                       ///< brighter pixels are flame
  bool specks = true;  ///< whether those without three flame pixels among their neighbours count too

  [[nodiscard]] HOST_DEVICE inline float brightness(int x, int y) const {
    const float* p = rgb + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                                static_cast<std::size_t>(x));
    const float most = p[0] < p[1] ? p[1] : p[0];
    return most < p[2] ? p[2] : most;
  }
  [[nodiscard]] HOST_DEVICE inline int bright(int x, int y) const {
    return x >= 0 && y >= 0 && x < width && y < height && brightness(x, y) > least ? 1 : 0;
  }
};

// One thread a block, a pixel or a row, `most` of them for each view.

struct BlockStatistics {
  double mean = 0;
  float peak = 0;
};
struct MeasureBlock {
  const FlameView* views = nullptr;
  std::size_t most = 1;
  BlockStatistics* to = nullptr;

  HOST_DEVICE inline void operator()(std::size_t at) const {
    const FlameView& view = views[at / most];
    const auto block = static_cast<int>(at % most);
    if (block >= view.blocks) return;
    const int x0 = block % view.across * view.edge;
    const int y0 = block / view.across * view.edge;
    double sum = 0;
    float peak = view.brightness(x0, y0);
    for (int y = y0; y < y0 + view.edge; ++y)
      for (int x = x0; x < x0 + view.edge; ++x) {
        const float here = view.brightness(x, y);
        sum += static_cast<double>(here);
        if (here > peak) peak = here;
      }
    to[at] = {sum / (view.edge * view.edge), peak};
  }
};

struct MaskPixel {
  static constexpr int kNeighbours = 3;
  const FlameView* views = nullptr;
  std::size_t most = 1;

  HOST_DEVICE inline void operator()(std::size_t at) const {
    const FlameView& view = views[at / most];
    const auto pixel = static_cast<int>(at % most);
    if (pixel >= view.width * view.height) return;
    const int x = pixel % view.width;
    const int y = pixel / view.width;
    int flame = view.bright(x, y);
    if (flame != 0 && !view.specks) {
      int around = -1;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) around += view.bright(x + dx, y + dy);
      flame = around >= kNeighbours ? 1 : 0;
    }
    view.flame[pixel] = static_cast<std::uint8_t>(flame);
  }
};

/// The first and the last flame pixel of a row, + 1; 0 and 0 where it has none.
struct RowOfFlame {
  int first = 0, last = 0;
};
struct FindRow {
  const FlameView* views = nullptr;
  std::size_t most = 1;
  RowOfFlame* to = nullptr;

  HOST_DEVICE inline void operator()(std::size_t at) const {
    const FlameView& view = views[at / most];
    const auto y = static_cast<int>(at % most);
    RowOfFlame row;
    if (y < view.height) {
      const std::uint8_t* flame =
          view.flame + static_cast<std::size_t>(y) * static_cast<std::size_t>(view.width);
      while (row.first < view.width && flame[row.first] == 0) ++row.first;
      row.last = view.width;
      while (row.last > row.first && flame[row.last - 1] == 0) --row.last;
      if (row.last == row.first) row = {};
    }
    to[at] = row;
  }
};

}  // namespace emberlock::recon
