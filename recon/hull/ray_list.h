// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/hull/medium.h"
#include "recon/kernels/cut.h"
#include "recon/kernels/march.h"
#include "recon/kernels/refract.h"
#include "recon/views/flame_mask.h"

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
class GpuRays;
struct RayList {
  Grid grid;
  std::vector<float> origins;  ///< 3 per view, in voxel edges from the grid's origin
  std::vector<MarchRay> rays;
  std::vector<Run> runs;
  std::vector<Bend> bends;                ///< one per run; empty for straight rays
  std::vector<std::uint32_t> pixels;      ///< pixel of each ray, y * width + x
  std::vector<std::size_t> subset_begin;  ///< subsets + 1 values
  std::vector<RayCounts> before;          ///< rays, runs and samples before each subset, and in all
  /// Where they were made on a GPU: there they are. If RayListOptions say so, rays, runs, bends and pixels
  /// are nowhere else.
  std::shared_ptr<const GpuRays> on_gpu;
  [[nodiscard]] RayTable table() const {
    return {origins.data(), rays.data(), runs.data(), bends.empty() ? nullptr : bends.data(),
            grid.nx,        grid.ny,     grid.nz};
  }
  [[nodiscard]] int subsets() const { return static_cast<int>(subset_begin.size()) - 1; }
  [[nodiscard]] const RayCounts& count() const { return before.back(); }
  bool curved = false;
};
/// The length of all runs, voxel edges.
double total_length(const RayList& list, Pool& pool);

struct RayListOptions {
  float step = 1;  ///< maximum step, voxel edges
  int subsets = 1;
  PixelRule rule;  ///< which subset a pixel is in
  /// The same where no PixelRule tells; the CPU asks it for each pixel.
  std::function<int(std::size_t view, int x, int y)> subset_of;
  std::vector<PixelBox> boxes;  ///< one a view: pixels beyond have no ray; whole pictures where empty
  /// Whether a list that is made on a GPU is copied to the CPU's memory too.
  enum class Home { cpu, where_it_is_made };
  Home home = Home::cpu;
  /// Gas that bends the rays, in the medium's voxel edges; the list then has bends. Null: straight rays.
  const IndexField* gas = nullptr;
};

RayList clip_rays(const std::vector<const CameraModel*>& cameras, const Hull& medium,
                  const RayListOptions& options, Pool& pool);

}  // namespace emberlock::recon
