// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "recon/export/shared_volume.h"

namespace emberlock::recon {

/// Writes a NanoVDB file (.nvdb, uncompressed, version of Debian's 10.0) of all grids, for renderers on GPUs:
/// NanoGrid<float> of class FogVolume, or NanoGrid<Vec3f> where there are three values a key point. Index
/// (i, j, k) is key point (i, j, k), the map leads to metres, and points with value zero are inactive. The
/// format has room for a grid's name, and none for units and provenance. Errors (io): it can't be written.
Status write_nanovdb(const SharedVolume& volume, const std::filesystem::path& path);

}  // namespace emberlock::recon
