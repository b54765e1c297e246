// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "session/video_display.h"

namespace emberlock::session {

/// Properties of a video file, read from its packets. Where packets have no time stamps of their own
/// (program streams, AVI with B-frames), all frames are decoded, and those without a stamp get one between
/// their neighbours'.
struct VideoScan {
  ImageSize size;
  std::vector<std::int64_t> ticks;  ///< each frame's time stamp, in the decoder's order
  std::vector<std::int64_t> keys;   ///< indices of the key frames; about where they are if `counted`
  Seconds tick{};                   ///< duration of one tick; 0 for pictures, which have no time stamps
  /// Frames are found by counting from the first, because not each has a stamp of its own.
  bool counted = false;
  std::optional<Hertz> frame_rate{};        ///< from the time stamps; absent with fewer than two frames
  std::optional<std::int64_t> irregular{};  ///< first frame that breaks the regular frame rate
  std::string irregularity;                 ///< one sentence on the fault at that frame
  std::int64_t promised = 0;                ///< number of frames that the container states; 0: none
  std::optional<std::int64_t>
      created_ns{};  ///< since 1970-01-01, by the camera's clock, if the file states it

  std::vector<std::string> unapplied{};  ///< FrameFile::unapplied()
  VideoDisplay display{};
  bool sound = false;  ///< the file has a sound track

  [[nodiscard]] std::int64_t frames() const { return static_cast<std::int64_t>(ticks.size()); }
  /// The file ends before the number of frames that the container states.
  [[nodiscard]] bool truncated() const;
};

/// Pictures count as a video without time stamps. Errors (bad_input): neither picture nor video, no frames,
/// frames without time stamps.
Result<VideoScan> scan_video(const std::filesystem::path& path);

/// Of a frame of a film, counted from 0, that has another size than those before it.
Error size_changed(const std::string& film, std::int64_t frame, ImageSize size, ImageSize before);

/// Of a picture of a camera's film that has another EXIF orientation than its first.
Error orientation_changed(const std::filesystem::path& picture);

/// Index of the first frame that breaks the regular rate: its interval differs from the median by more than a
/// tenth (plus one tick, the rounding of containers), or its time has drifted from the regular grid of the
/// earlier frames by a quarter of a period. Pure.
std::optional<std::int64_t> first_irregular(const std::vector<std::int64_t>& ticks);

}  // namespace emberlock::session
