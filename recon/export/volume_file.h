// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "recon/effects/lighting.h"
#include "recon/export/certificate.h"
#include "recon/export/shared_volume.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// A further grid of a volume's key points: one value each, or three interleaved.
struct NamedGrid {
  const char* name;
  const char* unit;
  const std::vector<float>& values;
};

/// Writes an OpenVDB file for Houdini, Blender and ParaView:
///   `emission`  Vec3SGrid, RGB source of dL = S ds, grey levels (0..255) per metre
///   `density`   FloatGrid, extinction sigma_t, 1/m
///   `medium`    FloatGrid where Volume::inside isn't empty: 1 at the lowest corner of each voxel that the
///               medium fills. `emission` and `density` hold inside of these voxels; beyond them is nothing
/// and `further` ones as FloatGrids, or Vec3SGrids where there are three values a point.
/// Index (i, j, k) is key point (i, j, k); the grids' transform maps indices to metres. Points with value
/// zero are inactive (background 0). Voxels below 0.02 mm, which OpenVDB refuses, are written in millimetres,
/// with `emberlock_metres_per_unit` 0.001. The metadata contain the units and the dimensions
/// (`emberlock_dimensions`), which a sparse grid loses. The file's metadata tell what the medium scatters:
/// `emberlock_scattering` (single or multiple), `emberlock_albedo` and `emberlock_asymmetry`, of light that
/// isn't in `emission`; `emberlock_light` (even, distant or nearby), `_place` (towards it, or metres),
/// `_strength` and `_ambient` (grey levels, as Light has them), of light whose scattered part is `emission`.
/// `emberlock_certificate` tells what the volume was made from (certificate.h).
/// `path` is written in place: call it inside an OutputFolder.
Status write_volume(const Volume& volume, const std::filesystem::path& path,
                    const std::vector<NamedGrid>& further = {}, const Lighting& lighting = {},
                    const Certification& certification = {});

/// Reads a file of write_volume(), bit-identically; a density without active points becomes an empty
/// extinction. Errors (bad_input): not such a file, or one whose bytes were changed since (volume_kind.h);
/// missing grids or metadata.
Result<Volume> read_volume(const std::filesystem::path& path);

/// What a file's medium scatters; nothing in files that don't tell. Errors: not an OpenVDB file; metadata of
/// another type, a word that isn't known or a value that is missing or out of its range.
Result<Lighting> read_lighting(const std::filesystem::path& path);

/// The values of a further grid, bit-identically; 0 where none is active. Errors: as read_volume(); no such
/// grid.
Result<std::vector<float>> read_grid(const std::filesystem::path& path, const std::string& name);
/// The same of a grid that has one value for each of `grid`'s key points; nothing where there is no grid of
/// that name. Error: another number of values.
Result<std::optional<std::vector<float>>> read_values(const std::filesystem::path& path,
                                                      const std::string& name, const Grid& grid);

/// All grids of a file of write_volume() but `medium`, in the order of their names; their provenance is left
/// empty. Bit-identical, except that `emission` and `density` of key points on the medium's border are
/// multiplied by shares_inside(), as other programs interpolate beyond it. Errors: as read_volume().
Result<SharedVolume> read_shared_volume(const std::filesystem::path& path);

/// Where a program that opens a file takes a voxel's value to be.
enum class VdbSamples {
  at_index,           ///< as OpenVDB, Houdini and Blender from 5.0 do
  half_an_edge_later  ///< on each axis, as Blender before 5.0 does: the grids' transform takes it back,
                      ///< zeros are put around colours, and `density` below 1e-5 a voxel is none, for those
                      ///< versions' sake
};
/// Writes an OpenVDB file for other programs: all grids of `volume`, as write_volume() would, one value a
/// point of class FOG_VOLUME; a scalar grid `density` even where nothing is dense, as without one Blender's
/// Principled Volume takes the whole box for dense. Meaning and unit of a grid and where the volume comes
/// from stand in its metadata (`meaning`, `unit`, `creator`, `emberlock_input`, `emberlock_frame`,
/// `emberlock_up`, and what the medium scatters, as write_volume() has it), and the latter in the file's,
/// with its certificate. At the index, read_volume() and read_lighting() read it too. Errors: as
/// write_volume().
Status write_vdb(const SharedVolume& volume, const std::filesystem::path& path, VdbSamples samples);

}  // namespace emberlock::recon
