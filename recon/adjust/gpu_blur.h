// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/compute/cuda_launch.h"
#include "recon/effects/exposure.h"
#include "recon/kernels/exposure.h"

namespace emberlock::recon {

/// B and its transpose.
template <class Real>
class GpuBlur {
 public:
  GpuBlur(const ExposureBlur& blur, const Grid& grid)
      : grid_(grid), weights_(blur.weights()), blurred_(CudaBuffer<Quad<Real>>::unfilled(grid.size())) {}

  [[nodiscard]] const Quad<Real>* forward(const CudaBuffer<Quad<Real>>& x) { return average(x, 1); }
  [[nodiscard]] const Quad<Real>* adjoint(const CudaBuffer<Quad<Real>>& y) { return average(y, -1); }

 private:
  const Quad<Real>* average(const CudaBuffer<Quad<Real>>& in, int direction) {
    launch(grid_.size(),
           AverageAlongZ<Real>{in.data(), blurred_.data(), grid_.index(0, 0, 1), grid_.nz, weights_.data(),
                               static_cast<int>(weights_.size() / 2), direction},
           "exposing");
    return blurred_.data();
  }

  Grid grid_;
  CudaBuffer<float> weights_;
  CudaBuffer<Quad<Real>> blurred_;
};

}  // namespace emberlock::recon
