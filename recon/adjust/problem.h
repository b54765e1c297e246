// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/residual.h"
#include "recon/kernels/rgba.h"

namespace emberlock::recon {

struct View;
class RefractiveIndex;

/// The runs in each slab of voxels along z. Even slabs share no key point and can be written at the same
/// time, then odd ones, without atomics and in an order that no thread count changes.
struct SlabRuns {
  std::vector<std::size_t> begin;  ///< slabs + 1 values into `run`
  std::vector<std::uint32_t> run;
};

/// What a solver works on: the rays of some views through a hull, what was seen along each, and which key
/// points take part.
struct Problem {
  CroppedHull crop;
  RayList list;
  std::vector<Rgba> seen;            ///< the pixel of each ray, grey levels; lane 3: its View::bounds
  std::vector<Rgba> background;      ///< behind each ray, grey levels; empty where it is black
  std::vector<std::uint8_t> active;  ///< key points of the hull's voxels, 1 or 0
  std::vector<Slice> row_span;       ///< for each row (j, k) of key points: first active i, last + 1
  std::vector<SlabRuns> slabs;       ///< one for each subset
  [[nodiscard]] const Grid& grid() const { return crop.hull.grid; }
  /// `offset` is what another pass adds to each ray's radiance; empty for nothing.
  template <class Real>
  [[nodiscard]] PixelResidual<Real> pixel_residual(const std::vector<Rgba>& offset, float white) const {
    return {seen.data(), background.empty() ? nullptr : background.data(),
            offset.empty() ? nullptr : offset.data(), Real(white)};
  }
  /// Of the subset that has most.
  [[nodiscard]] std::size_t most_samples() const;
  [[nodiscard]] int slab_count() const { return (grid().nz - 2) / kSlab + 1; }
};

struct ProblemOptions {
  Background background;
  const RefractiveIndex* gas = nullptr;  ///< bends the rays where it is given
  double step = 1;                       ///< the march's longest, voxel edges
  int subsets = 1;
  bool adjoint = true;  ///< whether residuals will be projected back; Problem::slabs is empty where not
  std::function<int(std::size_t view, int x, int y)>
      subset_of;  ///< -1 leaves a pixel out; all in subset 0 where empty
};

Problem make_problem(const std::vector<const View*>& views, const Hull& hull, const ProblemOptions& options,
                     Pool& pool);

/// Emission a voxel edge at the fine problem's active key points, from the next coarser solution by trilinear
/// interpolation.
std::vector<Rgba> refine(const std::vector<Rgba>& coarse, const Problem& from, const Problem& to);

}  // namespace emberlock::recon
