// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/hull/ray_list.h"
#include "recon/render/march_table.h"

namespace emberlock::recon {

struct MarchedRays {
  std::vector<Rgba> seen;             ///< radiance and transmittance, one a ray
  std::vector<std::uint32_t> pixels;  ///< of the ray
};
/// Radiance and transmittance of a list's rays through `source` (values at its grid's key points), on the
/// GPU; sigma of constant extinction is per voxel edge. Throws a DeviceError.
MarchedRays march_on_cuda(const RayList& list, const std::vector<Rgba>& source, Absorb absorb, float sigma);

}  // namespace emberlock::recon
