// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "recon/adjust/problem.h"
#include "recon/compute/cuda_buffer.h"
#include "recon/hull/gpu_rays.h"

namespace emberlock::recon {

/// A problem's pictures, and what it holds a ray and a key point, in a GPU's memory.
class GpuProblem {
 public:
  /// With its pictures alone.
  explicit GpuProblem(const Problem& problem);
  /// Where a problem is, copied there if it isn't yet.
  static std::shared_ptr<const GpuProblem> of(const Problem& problem);

  std::shared_ptr<const GpuRays> rays;
  CudaBuffer<ViewPixels> views;
  CudaBuffer<Rgba> seen, background;  // the latter null where it is black
  CudaBuffer<float> share;

 private:
  std::vector<std::shared_ptr<const void>> pictures_;  // to which the views point
};

}  // namespace emberlock::recon
