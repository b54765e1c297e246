#pragma once

#include <filesystem>

#include "base/result.h"
#include "recon/render/volume.h"

namespace emberlock {

/// Writes an OpenVDB file with two grids, as Houdini, Blender and ParaView read them:
///   `emission`  Vec3SGrid, RGB source of dL = S ds, grey levels (0..255) per metre
///   `density`   FloatGrid, extinction sigma_t, 1/m
/// Index (i, j, k) lies at key point (i, j, k); the grids' transform maps indices to metres. Points of value
/// zero are inactive (background 0). The grids' metadata name the units, and the dimensions
/// (`emberlock_dimensions`), which a sparse grid loses. `path` is written in place: call it inside an
/// AtomicDirectory.
Status write_volume(const Volume& volume, const std::filesystem::path& path);

/// Reads back what write_volume() wrote, to the same bits; a density without active points becomes an empty
/// extinction. Errors: not an OpenVDB file, grids or metadata missing.
Result<Volume> read_volume(const std::filesystem::path& path);

}  // namespace emberlock
