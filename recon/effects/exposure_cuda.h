// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/kernels/exposure.h"
#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// AverageAlongZ at all key points of a grid, on the GPU, with the weights of ExposureBlur. Throws a
/// DeviceError.
std::vector<Rgba> average_on_cuda(const std::vector<Rgba>& in, const Grid& grid,
                                  const std::vector<float>& weights, int direction);

}  // namespace emberlock::recon
