// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// A reconstructed flame: values at the grid's key points, trilinear between them.
struct Volume {
  Grid grid;
  std::vector<float>
      emission;  ///< source S of dL = S ds, RGB interleaved, grey levels (0..255) per metre; 3 * size
  std::vector<float> extinction;  ///< sigma_t, 1/m; size() values, or empty if nothing absorbs
};

}  // namespace emberlock::recon
