// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>

#include "base/host_device.h"
#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// The flame pixels of a view, 1 or 0, row-major, and where to count them: how many lie above and left of
/// every pixel corner (a summed-area table of (width + 1) * (height + 1) values, the first row and column
/// zero).
struct FlameTable {
  const std::uint8_t* flame = nullptr;
  std::uint32_t* sums = nullptr;
  int width = 0, height = 0;
};

/// The first pass over tables of `rows` rows at most: one row of pixels, view by view.
struct SumAlongRow {
  const FlameTable* tables = nullptr;
  std::size_t rows = 0;

  HOST_DEVICE void operator()(std::size_t at) const {
    const FlameTable t = tables[at / rows];
    const std::size_t y = at % rows;
    if (y >= static_cast<std::size_t>(t.height)) return;
    const auto width = static_cast<std::size_t>(t.width);
    std::uint32_t* to = t.sums + (y + 1) * (width + 1) + 1;
    std::uint32_t sum = 0;
    for (std::size_t x = 0; x < width; ++x) to[x] = sum += t.flame[y * width + x];
  }
};

/// The second pass: a strip of columns, of `strips` that no table has more of.
struct SumDownColumns {
  const FlameTable* tables = nullptr;
  std::size_t strips = 0;
  std::size_t strip = 1;  ///< columns; a cache line's on the CPU, one on the GPU

  HOST_DEVICE void operator()(std::size_t at) const {
    const FlameTable t = tables[at / strips];
    const std::size_t row = static_cast<std::size_t>(t.width) + 1;
    const std::size_t begin = at % strips * strip;
    const std::size_t end = begin + strip < row ? begin + strip : row;
    std::uint32_t* to = t.sums + row;
    for (int y = 1; y < t.height; ++y, to += row)
      for (std::size_t x = begin; x < end; ++x) to[row + x] += to[x];
  }
};

/// A camera as a kernel needs it, and its FlameTable's sums.
struct Silhouette {
  float rotation[9] = {};     ///< camera_from_world, row-major
  float translation[3] = {};  ///< metres
  float fx = 0, fy = 0, cx = 0, cy = 0;
  float k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;
  int width = 0, height = 0;
  const std::uint32_t* flame_pixels = nullptr;
};

enum class Verdict {
  carved,  ///< seen wholly, and no flame pixel
  flame,   ///< nothing inside it can be carved by this view: all flame pixels, or all out of its sight
  mixed,
};

/// What a view says of a cube of `size` voxels whose lowest key point is (i, j, k): the flame pixels inside
/// the bounding rectangle of its eight projected corners.
struct ClassifyCube {
  Grid grid;

  HOST_DEVICE Verdict operator()(const Silhouette& s, int i, int j, int k, int size) const {
    float low[2] = {1e30F, 1e30F};
    float high[2] = {-1e30F, -1e30F};
    const float side = static_cast<float>(size) * grid.edge;
    int behind = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const float world[3] = {
          grid.origin[0] + static_cast<float>(i) * grid.edge + static_cast<float>(corner & 1) * side,
          grid.origin[1] + static_cast<float>(j) * grid.edge + static_cast<float>((corner >> 1) & 1) * side,
          grid.origin[2] + static_cast<float>(k) * grid.edge + static_cast<float>(corner >> 2) * side};
      float u = 0;
      float v = 0;
      if (!project(s, world, u, v)) {
        ++behind;
        continue;
      }
      low[0] = fminf(low[0], u);
      low[1] = fminf(low[1], v);
      high[0] = fmaxf(high[0], u);
      high[1] = fmaxf(high[1], v);
    }
    if (behind == 8) return Verdict::flame;
    if (behind > 0) return Verdict::mixed;
    const auto width = static_cast<float>(s.width);
    const auto height = static_cast<float>(s.height);
    if (high[0] < 0 || high[1] < 0 || low[0] >= width || low[1] >= height) return Verdict::flame;
    if (low[0] < 0 || low[1] < 0 || high[0] >= width || high[1] >= height) return Verdict::mixed;
    const int x0 = static_cast<int>(low[0]);
    const int y0 = static_cast<int>(low[1]);
    const int x1 = static_cast<int>(high[0]) + 1;
    const int y1 = static_cast<int>(high[1]) + 1;
    const std::size_t row = static_cast<std::size_t>(s.width) + 1;
    const std::uint32_t* top = s.flame_pixels + static_cast<std::size_t>(y0) * row;
    const std::uint32_t* bottom = s.flame_pixels + static_cast<std::size_t>(y1) * row;
    const std::uint32_t flame = bottom[x1] - bottom[x0] - top[x1] + top[x0];
    if (flame == 0) return Verdict::carved;
    return flame == static_cast<std::uint32_t>((x1 - x0) * (y1 - y0)) ? Verdict::flame : Verdict::mixed;
  }

  HOST_DEVICE static bool project(const Silhouette& s, const float* world, float& u, float& v) {
    float p[3];
    for (int r = 0; r < 3; ++r)
      p[r] = s.rotation[3 * r] * world[0] + s.rotation[3 * r + 1] * world[1] +
             s.rotation[3 * r + 2] * world[2] + s.translation[r];
    if (p[2] < 1e-4F) return false;
    const float x = p[0] / p[2];
    const float y = p[1] / p[2];
    const float r2 = x * x + y * y;
    const float radial = 1 + r2 * (s.k1 + r2 * (s.k2 + r2 * s.k3));
    u = s.fx * (x * radial + 2 * s.p1 * x * y + s.p2 * (r2 + 2 * x * x)) + s.cx;
    v = s.fy * (y * radial + s.p1 * (r2 + 2 * y * y) + 2 * s.p2 * x * y) + s.cy;
    return true;
  }
};

/// The verdicts of all views, at most 64, on the way from large cubes to the voxels in them: what settles a
/// cube for a view settles it for all that lies inside. A set of views has bit v for view v.
struct ClassifyCubes {
  ClassifyCube classify;
  const Silhouette* views = nullptr;
  int count = 0;

  static constexpr int kRoot = 16;  ///< voxels along the largest cubes

  [[nodiscard]] HOST_DEVICE std::uint64_t all() const { return ~std::uint64_t{0} >> (64 - count); }
  /// Whether one of the views in `open` carves the cube; those for which it is settled leave the set.
  HOST_DEVICE bool carved(int i, int j, int k, int size, std::uint64_t& open) const {
    for (int v = 0; v < count; ++v) {
      if ((open >> v & 1) == 0) continue;
      const Verdict verdict = classify(views[v], i, j, k, size);
      if (verdict == Verdict::carved) return true;
      if (verdict == Verdict::flame) open &= ~(std::uint64_t{1} << v);
    }
    return false;
  }
};

/// One voxel of the hull: from the largest cube around it down to itself.
struct CarveVoxel {
  ClassifyCubes cubes;
  std::uint8_t* inside = nullptr;  ///< 1 or 0, voxel (i, j, k) as Hull stores it

  HOST_DEVICE void operator()(std::size_t voxel) const {
    const Grid& g = cubes.classify.grid;
    const auto mx = static_cast<std::size_t>(g.nx - 1);
    const auto my = static_cast<std::size_t>(g.ny - 1);
    const int i = static_cast<int>(voxel % mx);
    const int j = static_cast<int>(voxel / mx % my);
    const int k = static_cast<int>(voxel / (mx * my));
    std::uint64_t open = cubes.all();
    inside[voxel] = 1;
    for (int size = ClassifyCubes::kRoot; size > 0 && open != 0; size /= 2) {
      if (cubes.carved(i & -size, j & -size, k & -size, size, open)) {
        inside[voxel] = 0;
        return;
      }
    }
  }
};

}  // namespace emberlock::recon
