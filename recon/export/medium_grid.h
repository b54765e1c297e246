// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/result.h"
#include "recon/export/shared_volume.h"
#include "recon/render/volume.h"

// The voxels that a medium fills (Volume::inside) as a grid of key points: each voxel at its lowest corner.
namespace emberlock::recon {

inline constexpr const char* kMedium = "medium";

/// 1 or 0 at each key point.
std::vector<float> medium_values(const Volume& volume);
/// The reverse. Error: another number of values than key points; it names `path`.
Result<std::vector<std::uint8_t>> voxels_of_medium(const std::vector<float>& values, const Grid& grid,
                                                   const std::filesystem::path& path);
/// Takes the grid out of a volume for other programs, which interpolate beyond the medium's border: emission
/// and density of key points there are multiplied by shares_inside(), so that they add up to the same.
Status fold_medium(SharedVolume& volume, const std::filesystem::path& path);

}  // namespace emberlock::recon
