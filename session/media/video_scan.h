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

namespace emberlock::session {

/// What a video file holds, told from its packets: nothing is decoded.
struct VideoScan {
  ImageSize size;
  std::vector<std::int64_t> ticks;           ///< each frame's time stamp, in the order of showing
  std::vector<std::int64_t> keys;            ///< places of the frames that are decoded without others
  Seconds tick{};                            ///< what a time stamp counts
  std::optional<Hertz> frame_rate{};         ///< by the time stamps; absent of fewer than two frames
  std::optional<std::int64_t> irregular{};   ///< first frame that doesn't follow at the rate of the others
  std::string irregularity;                  ///< what is wrong there, one sentence
  std::int64_t promised = 0;                 ///< frames, by the container; 0: it doesn't say
  std::optional<std::int64_t> created_ns{};  ///< since 1970, by the camera's clock, where the file tells

  [[nodiscard]] std::int64_t frames() const { return static_cast<std::int64_t>(ticks.size()); }
  /// It ends before its promised end.
  [[nodiscard]] bool truncated() const;
};

/// A picture is a video of one frame. Errors (bad_input): no picture and no video, no frames, frames without
/// time stamps.
Result<VideoScan> scan_video(const std::filesystem::path& path);

/// The first place at which frames don't follow evenly: an interval that is off the median by more than a
/// tenth (and a tick, to which containers round), or a frame that has moved by a quarter of a period off
/// those before. Pure.
std::optional<std::int64_t> first_irregular(const std::vector<std::int64_t>& ticks);

}  // namespace emberlock::session
