// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "recon/compute/cuda_buffer.h"
#include "recon/hull/ray_list.h"

namespace emberlock::recon {

/// A list's rays in a GPU's memory.
class GpuRays {
 public:
  /// Empty, to be filled.
  explicit GpuRays(const RayList& list)
      : origins(list.origins), nx_(list.grid.nx), ny_(list.grid.ny), nz_(list.grid.nz) {}
  /// Those of a list, shared where they are on a GPU already.
  static std::shared_ptr<const GpuRays> of(const RayList& list) {
    if (list.on_gpu) return list.on_gpu;
    auto copied = std::make_shared<GpuRays>(list);
    copied->rays = CudaBuffer<MarchRay>(list.rays);
    copied->runs = CudaBuffer<Run>(list.runs);
    copied->bends = CudaBuffer<Bend>(list.bends);
    copied->pixels = CudaBuffer<std::uint32_t>(list.pixels);
    return copied;
  }

  [[nodiscard]] RayTable table() const {
    return {origins.data(), rays.data(), runs.data(), bends.data(), nx_, ny_, nz_};
  }

  CudaBuffer<float> origins;
  CudaBuffer<MarchRay> rays;
  CudaBuffer<Run> runs;
  CudaBuffer<Bend> bends;  // empty for straight rays
  CudaBuffer<std::uint32_t> pixels;

 private:
  int nx_, ny_, nz_;
};

}  // namespace emberlock::recon
