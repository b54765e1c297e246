// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "recon/kernels/carve.h"
#include "recon/views/flame_mask.h"

namespace emberlock::recon {

/// Carves a grid with the views (at most 64, their tables not yet built) on the GPU; `masks` are theirs.
/// Throws a DeviceError.
void carve_on_cuda(const Grid& grid, std::vector<Silhouette> views,
                   const std::vector<const FlameMask*>& masks, std::vector<std::uint8_t>& inside);

}  // namespace emberlock::recon
