// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string_view>

#include "base/result.h"

// Which files may be handed to OpenVDB. Its readers trust each size that a file states: a damaged one makes
// them allocate gigabytes. So a file is read only when all of its bytes are as they were sealed, and its
// layout is one that Emberlock writes: a seal without a signature can be forged.
namespace emberlock::recon {

/// A marker at the end of the file, which OpenVDB's readers don't read (they use offsets).
inline constexpr std::string_view kEndOfVolume = "emberlock: end of volume";
/// The marker of a file whose values lie elsewhere than OpenVDB states: it isn't read as a volume.
inline constexpr std::string_view kEndOfLaterVolume = "emberlock: end of volume, half an edge back";

/// What a file's first and last bytes show.
enum class VolumeKind {
  volume,
  half_an_edge_later,  ///< an export for Blender before 5.0
  cut_short,           ///< begins as a volume of Emberlock's
  foreign,             ///< OpenVDB, of another program
  not_openvdb,
};
/// Errors (bad_input): no such file, not a regular one.
Result<VolumeKind> kind_of_volume(const std::filesystem::path& path);

/// Succeeds where the file is a volume whose bytes are as they were written: by its seal (certificate.h), or,
/// without a certificate, by its identifier (vdb_identity.h), and their sizes agree (vdb_layout.h). Errors
/// (bad_input): any other kind, changed bytes, another layout.
Status check_volume_file(const std::filesystem::path& path);

}  // namespace emberlock::recon
