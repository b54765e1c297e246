// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/compute/cuda_buffer.h"
#include "recon/hull/ray_list.h"

namespace emberlock::recon {

/// A list's rays on the GPU.
class DeviceRayList {
 public:
  explicit DeviceRayList(const RayList& list)
      : grid_(list.grid), origins_(list.origins), rays_(list.rays), runs_(list.runs), bends_(list.bends) {}

  [[nodiscard]] RayTable table() const {
    return {origins_.data(), rays_.data(), runs_.data(), bends_.data(), grid_.nx, grid_.ny, grid_.nz};
  }

 private:
  Grid grid_;
  CudaBuffer<float> origins_;
  CudaBuffer<MarchRay> rays_;
  CudaBuffer<Run> runs_;
  CudaBuffer<Bend> bends_;  // empty for straight rays
};

}  // namespace emberlock::recon
