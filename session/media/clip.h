// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "session/media/frame_file.h"
#include "session/media/video_scan.h"

namespace emberlock::session {

/// One file of a camera's film.
struct ClipPart {
  std::filesystem::path path;
  VideoScan scan;
  std::int64_t first = 0;  ///< index of its first frame within the film
};

/// A camera's film in one or several consecutive files: a video that the camera split, or pictures.
/// Read-only.
class ClipReader {
 public:
  explicit ClipReader(std::vector<ClipPart> parts, Colours colours);

  [[nodiscard]] std::int64_t frames() const;
  /// The next call of next() returns the frame at this place.
  Status seek(std::int64_t place);
  /// The place of the frame that next() will return.
  [[nodiscard]] std::int64_t place() const { return place_; }
  /// Errors: out_of_data after the last frame; bad_input where a file is damaged, naming file and frame.
  Result<Image> next();

 private:
  [[nodiscard]] std::size_t part_of(std::int64_t place) const;
  /// Opens a part at its first frame.
  Status open(std::size_t part);

  std::vector<ClipPart> parts_;
  Colours colours_;
  std::int64_t place_ = 0;
  std::size_t open_ = 0;  ///< the part that `file_` reads
  std::unique_ptr<FrameFile> file_;
};

}  // namespace emberlock::session
