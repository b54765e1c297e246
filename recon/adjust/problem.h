#pragma once

#include <functional>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/rgba.h"

namespace emberlock {

struct View;

/// Rays that meet a slab of voxels along z. Slabs that have one between them share no key point, so even
/// slabs can be written at the same time, then odd ones, without atomics and in an order that no thread count
/// changes.
struct SlabRays {
  std::vector<std::size_t> begin;  ///< slabs + 1 values into `ray`
  std::vector<std::uint32_t> ray;
};

/// What a solver works on: the rays of some views through a hull, what was seen along each, and which key
/// points take part.
struct Problem {
  static constexpr int kSlab = 4;  ///< voxels

  CroppedHull crop;
  RayList list;
  std::vector<Rgba> seen;            ///< the pixel of each ray, grey levels
  std::vector<std::uint8_t> active;  ///< key points of the hull's voxels, 1 or 0
  std::vector<Slice> row_span;       ///< for each row (j, k) of key points: first active i, last + 1
  std::vector<SlabRays> slabs;       ///< one for each subset
  [[nodiscard]] const Grid& grid() const { return crop.hull.grid; }
  [[nodiscard]] int slab_count() const { return (grid().nz - 2) / kSlab + 1; }
};

struct ProblemOptions {
  int subsets = 1;
  std::function<int(std::size_t view, int x, int y)>
      subset_of;            ///< -1 leaves a pixel out; all in subset 0 where empty
  double black_below = -1;  ///< grey levels: pixels at or below it count as black
};

Problem pose(const std::vector<const View*>& views, const Hull& hull, const ProblemOptions& options,
             Pool& pool);

/// Emission a voxel edge at the fine problem's active key points, from the next coarser solution by trilinear
/// interpolation.
std::vector<Rgba> refine(const std::vector<Rgba>& coarse, const Problem& from, const Problem& to);

}  // namespace emberlock
