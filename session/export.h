// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/output_folder.h"
#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::session {

enum class ExportFormat {
  png,  ///< CAMERA/000000.png, ...: samples as recorded, 9 to 16 bits stored in 16; Bayer as a mosaic; stamps
        ///< in frames.csv
  video,  ///< CAMERA.mp4 for viewing: H.264 (MPEG-4 if libav has no H.264 encoder), 8 bits, chroma at half
          ///< resolution
};

struct ExportedCamera {
  std::string camera_id;
  std::string file;              ///< within the export: the folder of images, or the video
  std::uint64_t frames = 0;      ///< exported
  std::uint64_t unreadable = 0;  ///< left out because they can't be read back
  std::uint64_t gaps = 0;        ///< places where frames are missing
  std::uint64_t repeated = 0;    ///< in a video: frames repeated to fill gaps, so that the playing time stays
                                 ///< right; each is marked by a hatched bar at its lower edge
  Hertz frame_rate;              ///< of a video: constant, the camera's own
};

struct ExportReport {
  std::vector<ExportedCamera> cameras;
  std::string codec;  ///< of videos: libav's name of the codec
};

/// The verb that writes the folder.
inline constexpr OutputVerb kExport{"sessions export"};

/// Exports a session for other programs to the OutputFolder `target`. Errors: bad_input (no session, target
/// in the way), io, refused (cancelled by the observer).
Result<ExportReport> export_session(const std::filesystem::path& folder, const std::filesystem::path& target,
                                    ExportFormat format, const Observer& observer = {});

}  // namespace emberlock::session
