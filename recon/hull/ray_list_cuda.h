// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/hull/ray_list.h"
#include "recon/kernels/cut.h"

namespace emberlock::recon {

/// Pixels of some views, sorted by subset; subset_begin has subsets + 1 values.
struct PixelsInOrder {
  std::vector<PixelOfView> pixels;
  std::vector<std::size_t> subset_begin;
};

/// The pixels that may have a ray, in the order of the resulting list.
PixelsInOrder pixels_in_order(const std::vector<const CameraModel*>& cameras, const Grid& grid,
                              const RayListOptions& options, Pool& pool);

/// Computes the pixels' rays on the GPU, which keeps them; `cut` points to the CPU's memory. `list` must have
/// its grid and origins, and receives the rest. Throws a DeviceError.
void cut_on_cuda(const CutRay& cut, const std::vector<PixelRays>& cameras, const PixelsInOrder& pixels,
                 const RayListOptions& options, RayList& list);
/// The same of all pixels of the views' parts, by the options' rule.
void cut_on_cuda(const CutRay& cut, const std::vector<PixelRays>& cameras,
                 const std::vector<TiledView>& views, const RayListOptions& options, RayList& list);
/// SumLengths for each chunk.
void lengths_on_cuda(const GpuRays& rays, std::vector<double>& sums);

}  // namespace emberlock::recon
