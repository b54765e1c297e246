#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/hull/medium.h"
#include "recon/kernels/march.h"

namespace emberlock {

struct CameraModel;

/// The part of a hull's grid that holds all of it: its own grid, and where that starts in the whole one.
struct CroppedHull {
  Hull hull;
  int offset[3] = {0, 0, 0};
};
CroppedHull crop_to_medium(const Hull& hull);

/// A coarser hull: cubes of 2 x 2 x 2 voxels, kept where any of them is; key point (i, j, k) is the finer
/// (2i, 2j, 2k).
Hull coarsen(const Hull& hull);

/// Every pixel ray that crosses a medium, clipped to it. Rays are sorted by (subset, view, row, column).
struct RayList {
  Grid grid;
  std::vector<float> origins;  ///< 3 a view, in voxel edges from the grid's origin
  std::vector<MarchRay> rays;
  std::vector<Run> runs;
  std::vector<std::uint32_t> pixels;      ///< a ray's pixel, y * width + x
  std::vector<std::size_t> subset_begin;  ///< subsets + 1 values
  [[nodiscard]] RayTable table() const {
    return {origins.data(), rays.data(), runs.data(), grid.nx, grid.ny, grid.nz};
  }
  [[nodiscard]] int subsets() const { return static_cast<int>(subset_begin.size()) - 1; }
};

struct RayListOptions {
  float step = 1;  ///< the longest step, voxel edges
  int subsets = 1;
  /// The subset of a pixel, or -1 to leave it out; all in subset 0 where empty.
  std::function<int(std::size_t view, int x, int y)> subset_of;
};

RayList clip_rays(const std::vector<const CameraModel*>& cameras, const Hull& medium,
                  const RayListOptions& options, Pool& pool);

}  // namespace emberlock
