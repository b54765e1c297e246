#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/hull/medium.h"
#include "recon/kernels/march.h"
#include "recon/kernels/refract.h"

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

/// Every pixel ray that crosses a medium, clipped to it and cut where it enters another slab. Rays are sorted
/// by (subset, view, tile of pixels, row, column), runs and samples by ray.
struct RayList {
  Grid grid;
  std::vector<float> origins;  ///< 3 a view, in voxel edges from the grid's origin
  std::vector<MarchRay> rays;
  std::vector<Run> runs;
  std::vector<Bend> bends;                ///< one a run, or empty where rays are straight
  std::vector<std::uint32_t> pixels;      ///< a ray's pixel, y * width + x
  std::vector<std::size_t> subset_begin;  ///< subsets + 1 values
  [[nodiscard]] RayTable table() const {
    return {origins.data(), rays.data(), runs.data(), bends.empty() ? nullptr : bends.data(),
            grid.nx,        grid.ny,     grid.nz};
  }
  [[nodiscard]] int subsets() const { return static_cast<int>(subset_begin.size()) - 1; }
  /// The first run, or sample, of the ray `ray` or of those behind it; the number of all where there is none.
  [[nodiscard]] std::size_t first_run(std::size_t ray) const {
    return ray < rays.size() ? rays[ray].first_run : runs.size();
  }
  [[nodiscard]] std::size_t first_sample(std::size_t ray) const;
};

struct RayListOptions {
  float step = 1;  ///< the longest step, voxel edges
  int subsets = 1;
  /// The subset of a pixel, or -1 to leave it out; all in subset 0 where empty.
  std::function<int(std::size_t view, int x, int y)> subset_of;
  /// Gas that bends the rays, in the medium's voxel edges; the list then has bends. Straight where null.
  const IndexField* gas = nullptr;
};

RayList clip_rays(const std::vector<const CameraModel*>& cameras, const Hull& medium,
                  const RayListOptions& options, Pool& pool);

/// Cuts samples [0, count) of a stretch at the slabs' borders: piece(first, size), front to back. `z` is
/// where the line starts and `dz` its direction along z.
template <class Piece>
void cut_at_slabs(float z, float dz, float start, float step, int count, int layers, const Piece& piece) {
  const auto slab_of = [&](int i) {
    const float at = z + dz * (start + (static_cast<float>(i) + 0.5F) * step);
    return clamp_to(static_cast<int>(at), 0, layers - 1) / kSlab;
  };
  int first = 0;
  while (first < count) {
    const int slab = slab_of(first);
    int end = count;
    if (slab_of(count - 1) != slab) {
      const float border = static_cast<float>((dz > 0 ? slab + 1 : slab) * kSlab);
      const float guess = ((border - z) / dz - start) / step;
      end = clamp_to(static_cast<int>(guess), first + 1, count);
      while (end > first + 1 && slab_of(end - 1) != slab) --end;
      while (end < count && slab_of(end) == slab) ++end;
    }
    piece(first, end - first);
    first = end;
  }
}

}  // namespace emberlock
