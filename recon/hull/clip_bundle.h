// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "recon/kernels/clip.h"

namespace emberlock::recon {

/// Rays from one point, in voxel edges as clip_to_medium() takes them.
struct RayBundle {
  static constexpr int kMost = 16;

  const float* origin = nullptr;
  std::array<float, kMost> direction[3] = {};  ///< of unit length: x, y, z of each ray
  int rays = 0;
};

/// Where each ray of a bundle enters and leaves the medium, in turn.
using Crossings = std::array<std::vector<float>, RayBundle::kMost>;

/// What clip_to_medium() finds of each ray, bit for bit, for as many at once as the CPU's vectors hold:
/// neighbouring rays take nearly the same steps. Masks of fewer than 2^31 bytes, readable up to the next
/// multiple of 4.
void clip_bundle(const VoxelMask& mask, const VoxelMask& blocks, const RayBundle& bundle,
                 Crossings& crossings);

}  // namespace emberlock::recon
