// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/pictures.h"
#include "recon/kernels/residual.h"
#include "recon/kernels/rgba.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

struct View;
class RefractiveIndex;

/// The runs in each slab of voxels along z. Even slabs share no key point and can be written at the same
/// time, then odd ones, without atomics and in an order that no thread count changes.
struct SlabRuns {
  std::vector<std::size_t> begin;  ///< slabs + 1 values into `run`
  std::vector<std::uint32_t> run;
};

/// A view as a problem shows it: its picture, and what lies behind its flame.
struct ProblemPicture {
  SharedImage image;
  SharedBounds bounds;           ///< View::bounds
  SharedImage behind;            ///< null: the same everywhere
  std::array<float, 3> level{};  ///< that
};

class GpuProblem;

/// What a solver works on: the rays of some views through a hull, what was seen along each, and which key
/// points take part. Where it was made for a GPU, what is held a ray or a key point is there alone.
struct Problem {
  CroppedHull crop;
  RayList list;
  std::vector<ProblemPicture> pictures;  ///< one a view
  std::vector<Rgba> seen;                ///< the pixel of each ray, grey levels; lane 3: its View::bounds
  std::vector<Rgba> background;          ///< behind each ray, grey levels; empty where it is black
  std::vector<float>
      share;  ///< of each key point's eight voxels, that are inside the hull; 0: it takes no part
  std::vector<Slice> row_span;        ///< for each row (j, k) of key points: first that takes part, last + 1
  std::vector<SlabRuns> slabs;        ///< one for each subset
  bool is_before_background = false;  ///< one that isn't black
  std::shared_ptr<const GpuProblem> on_gpu;
  [[nodiscard]] const Grid& grid() const { return crop.hull.grid; }
  /// `offset` is what another pass adds to each ray's radiance; empty for nothing.
  template <class Real>
  [[nodiscard]] PixelResidual<Real> pixel_residual(const std::vector<Rgba>& offset, float white) const {
    return {seen.data(), background.empty() ? nullptr : background.data(),
            offset.empty() ? nullptr : offset.data(), Real(white)};
  }
  [[nodiscard]] std::size_t rays() const { return list.count().rays; }
  /// Of the subset that has most.
  [[nodiscard]] std::size_t most_samples() const;
  [[nodiscard]] int slab_count() const { return (grid().nz - 2) / kSlab + 1; }
  /// The pictures where they lie, in the CPU's memory.
  [[nodiscard]] std::vector<ViewPixels> view_pixels() const;
};

struct ProblemOptions {
  Background background;
  const RefractiveIndex* gas = nullptr;  ///< bends the rays where it is given
  double step = 1;                       ///< the march's longest, voxel edges
  int subsets = 1;
  bool adjoint = true;  ///< whether residuals will be projected back; Problem::slabs is empty where not
  // As in RayListOptions. With subset_of, or where the CPU is their home, rays are in the CPU's memory on
  // every device.
  PixelRule rule;
  std::function<int(std::size_t view, int x, int y)> subset_of;
  std::vector<PixelBox> boxes;
  RayListOptions::Home home = RayListOptions::Home::where_it_is_made;
};

Problem make_problem(const std::vector<const View*>& views, const Hull& hull, const ProblemOptions& options,
                     Pool& pool);

/// The problem's rays see other pictures from here on, of the same cameras and sizes. Its rays must be in the
/// CPU's memory; a CPU engine heeds it at once.
void show_pictures(Problem& problem, const std::vector<const View*>& views, const Background& background,
                   Pool& pool);

}  // namespace emberlock::recon
