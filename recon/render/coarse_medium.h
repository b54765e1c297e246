// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/compute/pool.h"
#include "recon/effects/effects.h"
#include "recon/hull/medium.h"
#include "recon/kernels/rgba.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// A medium on few key points, for light that is smooth.
struct CoarseMedium {
  Grid grid;                        ///< over the medium's box
  std::vector<Rgba> shine;          ///< grid.size(): emission and (lane 3) sigma_t a coarse edge
  std::vector<std::size_t> active;  ///< the key points with extinction in the voxels around them, rising
};

/// Means of the fine voxels inside the medium, weighted by each coarse key point's tent: its share of
/// trilinear interpolation. Integrals of emission and extinction stay what they were, but for what sharpening
/// would take below zero. `voxels` (>= 1) along the box's longest side, never more than the volume has there;
/// a hull with no voxel, or no extinction, gives no active key point.
CoarseMedium coarse_medium(const Volume& volume, const Hull& medium, const Extinction& extinction, int voxels,
                           Pool& pool);

}  // namespace emberlock::recon
