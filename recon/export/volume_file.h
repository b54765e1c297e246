// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// Writes an OpenVDB file with two grids, as Houdini, Blender and ParaView read them:
///   `emission`  Vec3SGrid, RGB source of dL = S ds, grey levels (0..255) per metre
///   `density`   FloatGrid, extinction sigma_t, 1/m
/// Index (i, j, k) lies at key point (i, j, k); the grids' transform maps indices to metres. Points of value
/// zero are inactive (background 0). Voxels below 0.02 mm, which OpenVDB refuses, are written in
/// millimetres: `emberlock_metres_per_unit` then says 0.001. The grids' metadata name the units, and the
/// dimensions
/// (`emberlock_dimensions`), which a sparse grid loses. `path` is written in place: call it inside an
/// OutputFolder.
Status write_volume(const Volume& volume, const std::filesystem::path& path);

/// Reads back what write_volume() wrote, to the same bits; a density without active points becomes an empty
/// extinction. Errors: not an OpenVDB file, grids or metadata missing.
Result<Volume> read_volume(const std::filesystem::path& path);

}  // namespace emberlock::recon
