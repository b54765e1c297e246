// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "recon/kernels/grid.h"

namespace emberlock::recon {

/// A reconstructed flame: values at the grid's key points, trilinear between them.
struct Volume {
  Grid grid;
  std::vector<float>
      emission;  ///< source S of dL = S ds, RGB interleaved, grey levels (0..255) per metre; 3 * size
  std::vector<float> extinction;  ///< sigma_t, 1/m; size() values, or empty if nothing absorbs
  /// The voxels that the medium fills, as Hull::inside; empty: those that hold anything. Key points on the
  /// medium's border emit and absorb only into these.
  std::vector<std::uint8_t> inside = {};
};

/// Of each key point's eight voxels the share that the medium fills; empty where `inside` is. Programs that
/// interpolate beyond the medium's border show the same light in all if values are multiplied by it.
std::vector<float> shares_inside(const Volume& volume);

}  // namespace emberlock::recon
