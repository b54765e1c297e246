// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/hull/medium.h"
#include "recon/kernels/rgba.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// A medium on few key points, for smooth light.
struct CoarseMedium {
  Grid grid;                        ///< over the medium's box
  std::vector<Rgba> shine;          ///< grid.size() values: emission and (lane 3) sigma_t per coarse edge
  std::vector<std::size_t> active;  ///< key points with extinction in an adjacent voxel, ascending
};

/// Averages the fine voxels inside the medium, weighted by each coarse key point's tent function (its share
/// of trilinear interpolation). Integrals of emission and extinction are preserved, except where values would
/// become negative. `voxels` (>= 1) along the box's longest side, at most as many as the volume has; a hull
/// without voxels or extinction gives no active key points.
CoarseMedium coarse_medium(const Volume& volume, const Hull& medium, const Extinction& extinction, int voxels,
                           Pool& pool);

}  // namespace emberlock::recon
