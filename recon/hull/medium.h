// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// The voxels that may contain the medium. Voxel (i, j, k) lies between key points (i, j, k) and (i + 1, j +
/// 1, k + 1) and is stored at i + (nx - 1) * (j + (ny - 1) * k).
struct Hull {
  Grid grid;
  std::vector<std::uint8_t> inside;  ///< 1 or 0; (nx - 1) * (ny - 1) * (nz - 1) values
  std::size_t count = 0;             ///< voxels inside
};

}  // namespace emberlock::recon
