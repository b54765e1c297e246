// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "recon/kernels/clip.h"

namespace emberlock::recon {

/// Rays from one point, in voxel edges, as for clip_to_medium().
struct RayBundle {
  static constexpr int kMost = 16;

  const float* origin = nullptr;
  std::array<float, kMost> direction[3] = {};  ///< unit length: x, y, z of each ray
  int rays = 0;
};

/// The points where each ray of a bundle enters and leaves the medium, alternately.
using Crossings = std::array<std::vector<float>, RayBundle::kMost>;

/// The same as clip_to_medium() for each ray, bit for bit, for as many rays at once as the CPU's vectors hold
/// (neighbouring rays take nearly the same steps). Masks must have fewer than 2^31 bytes and be readable up
/// to the next multiple of 4.
void clip_bundle(const VoxelMask& mask, const VoxelMask& blocks, const RayBundle& bundle,
                 Crossings& crossings);

}  // namespace emberlock::recon
