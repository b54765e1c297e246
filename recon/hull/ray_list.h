// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/hull/medium.h"
#include "recon/kernels/march.h"
#include "recon/kernels/refract.h"

namespace emberlock::recon {

struct CameraModel;

/// A hull cropped to the part of its grid that contains it: its own grid, and its origin in the original one.
struct CroppedHull {
  Hull hull;
  int offset[3] = {0, 0, 0};
};
CroppedHull crop_to_medium(const Hull& hull);

/// A coarser hull: cubes of 2 x 2 x 2 voxels, which are inside if any of their voxels is; key point (i, j, k)
/// is the finer (2i, 2j, 2k).
Hull coarsen(const Hull& hull);

/// All pixel rays that cross a medium, clipped to it and divided into runs at slab borders. Rays are sorted
/// by (subset, view, tile of pixels, row, column), runs and samples by ray.
struct RayList {
  Grid grid;
  std::vector<float> origins;  ///< 3 per view, in voxel edges from the grid's origin
  std::vector<MarchRay> rays;
  std::vector<Run> runs;
  std::vector<Bend> bends;                ///< one per run; empty for straight rays
  std::vector<std::uint32_t> pixels;      ///< pixel of each ray, y * width + x
  std::vector<std::size_t> subset_begin;  ///< subsets + 1 values
  [[nodiscard]] RayTable table() const {
    return {origins.data(), rays.data(), runs.data(), bends.empty() ? nullptr : bends.data(),
            grid.nx,        grid.ny,     grid.nz};
  }
  [[nodiscard]] int subsets() const { return static_cast<int>(subset_begin.size()) - 1; }
  /// The first run (or sample) of ray `ray` or of the rays after it; the total number if there is none.
  [[nodiscard]] std::size_t first_run(std::size_t ray) const {
    return ray < rays.size() ? rays[ray].first_run : runs.size();
  }
  [[nodiscard]] std::size_t first_sample(std::size_t ray) const;
};

struct RayListOptions {
  float step = 1;  ///< maximum step, voxel edges
  int subsets = 1;
  /// The subset of a pixel, or -1 to omit it. If empty, all pixels are in subset 0.
  std::function<int(std::size_t view, int x, int y)> subset_of;
  /// Gas that bends the rays, in the medium's voxel edges; the list then has bends. Null: straight rays.
  const IndexField* gas = nullptr;
};

RayList clip_rays(const std::vector<const CameraModel*>& cameras, const Hull& medium,
                  const RayListOptions& options, Pool& pool);

}  // namespace emberlock::recon
