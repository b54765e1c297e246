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
  png,    ///< CAMERA/000000.png, ...: samples as recorded, 9 to 16 bits in 16; Bayer as its mosaic; stamps in
          ///< frames.csv
  video,  ///< CAMERA.mp4: H.264 (MPEG-4 where libav lacks that encoder), 8 bits, colours half as fine: to
          ///< look at
};

struct ExportedCamera {
  std::string camera_id;
  std::string file;              ///< of the export: the folder of images, or the video
  std::uint64_t frames = 0;      ///< exported
  std::uint64_t unreadable = 0;  ///< left out: they can't be read back
  std::uint64_t gaps = 0;        ///< places where frames are missing
  std::uint64_t repeated = 0;    ///< in a video: frames shown again to fill gaps, so that time runs as it did
  Hertz frame_rate;              ///< of a video: constant, by the frames' stamps
};

struct ExportReport {
  std::vector<ExportedCamera> cameras;
  std::string codec;  ///< of videos: libav's name
};

/// Who makes the folder.
inline constexpr OutputVerb kExport{"sessions export"};

/// Writes a session for other programs to the folder `target`, an OutputFolder. Errors: bad_input (no
/// session, target in the way), io, refused (ended by the observer).
Result<ExportReport> export_session(const std::filesystem::path& folder, const std::filesystem::path& target,
                                    ExportFormat format, const Observer& observer = {});

}  // namespace emberlock::session
