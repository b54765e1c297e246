// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "recon/effects/lighting.h"
#include "recon/export/certificate.h"
#include "recon/kernels/grid.h"

// A volume as other programs open it: the grids of its volume.vdb with the names and units that they have
// there, `flame` beside them, and where they come from. Written by volume_file.h (OpenVDB), nanovdb_file.h
// and vti_file.h (VTK).
namespace emberlock::recon {

/// A quantity at each of a grid's key points, in their order.
struct SharedGrid {
  std::string name;
  std::string unit;
  std::string meaning;        ///< in words; may be empty
  std::vector<float> values;  ///< one a key point, or three interleaved
};

/// Where a volume comes from. What isn't known is empty.
struct Provenance {
  std::string program;  ///< "Emberlock 0.2.0"
  std::string input;    ///< what was reconstructed
  std::string up;       ///< the world's axis that points up: "z", "-y"
  std::optional<std::uint64_t> frame;
  Lighting lighting = {};  ///< what its medium scatters
};

struct SharedVolume {
  Grid grid;
  std::vector<SharedGrid> grids;
  Provenance provenance;
  Certification certification = {};  ///< of OpenVDB files; others have no place that all bytes are sealed in

  [[nodiscard]] const SharedGrid* find(const std::string& name) const;
};

inline constexpr const char* kFlame = "flame";

/// Luminance of linear RGB: 0.2126 R + 0.7152 G + 0.0722 B (ITU-R BT.709).
float luminance(const float* rgb);

/// The highest luminance of `emission`, grey levels per metre; 0 where there is no such grid.
float brightest(const SharedVolume& volume);

/// Adds the grid `flame`: the luminance of `emission` as a share of `white` (> 0, grey levels per metre), the
/// highest of all frames of a sequence, so that they don't flicker; 0..1. Nothing without `emission`.
void add_flame(SharedVolume& volume, float white);

/// Adds `temperature_told` to a volume that has `temperature`: 1 where a key point tells one, else 0. For
/// files without the active voxels that tell it in OpenVDB and NanoVDB.
void add_told(SharedVolume& volume);

}  // namespace emberlock::recon
