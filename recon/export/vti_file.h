// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "recon/export/shared_volume.h"

namespace emberlock::recon {

/// Writes VTK's XML image data (.vti, "VTK XML Formats", file version 1.0) for ParaView and VTK: a Float32
/// point array of each grid, raw and little-endian behind the XML, the origin and the spacing in metres, so
/// that point (i, j, k) is key point (i, j, k). Three values a point are named red, green and blue. Each
/// array has its unit (UNITS_LABEL), and the field data tell meanings and provenance. `flame` is what
/// programs show first. Errors (io): it can't be written.
Status write_vti(const SharedVolume& volume, const std::filesystem::path& path);

}  // namespace emberlock::recon
