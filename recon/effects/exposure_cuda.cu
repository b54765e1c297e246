// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/cuda_launch.h"
#include "recon/effects/exposure_cuda.h"

namespace emberlock::recon {

std::vector<Rgba> average_on_cuda(const std::vector<Rgba>& in, const Grid& grid,
                                  const std::vector<float>& weights, int direction) {
  const CudaBuffer<Rgba> from(in);
  const CudaBuffer<float> shares(weights);
  const auto to = CudaBuffer<Rgba>::unfilled(in.size());
  launch(in.size(),
         AverageAlongZ<float>{from.data(), to.data(), grid.index(0, 0, 1), grid.nz, shares.data(),
                              static_cast<int>(weights.size() / 2), direction},
         "exposing");
  return to.download();
}

}  // namespace emberlock::recon
