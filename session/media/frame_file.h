// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::session {

/// What a video says of itself: claims, not measurements.
struct VideoClaims {
  std::optional<Hertz> frame_rate{};
  std::optional<std::int64_t> frames{};
};

/// What becomes of a video's colours. A codec stores brightness at full resolution, and colours at less.
enum class Colours {
  keep,
  brightness,  ///< of a video stored as brightness and colour differences, the former alone: faster
};

/// Frames of a file that somebody else made: one image (PGM, PPM, PNG, JPEG, TIFF, FITS) or a video that
/// FFmpeg reads. Grey stays grey, colour becomes rgb8 or rgb16; 10..16-bit samples keep their values
/// (bit_depth is the file's maximum value's, e.g. a PGM with maxval 4095 is 12 bits).
class FrameFile {
 public:
  /// Errors name the file and say what is wrong with it (absent, truncated, not an image or video, no
  /// frames).
  static Result<std::unique_ptr<FrameFile>> open(const std::filesystem::path& path,
                                                 Colours colours = Colours::keep);
  virtual ~FrameFile() = default;
  /// The next frame; `out_of_data` after the last, `bad_input` where the file is damaged.
  virtual Result<Image> next() = 0;
  /// Has next() go on with the frame of this time stamp, in the file's ticks (`VideoScan::ticks`). A video
  /// whose index leads elsewhere is decoded from its start. Errors: bad_input (no video), or those of
  /// opening.
  virtual Status seek(std::int64_t ticks);
  /// The time stamp of the frame that next() gave last, where the video has such.
  [[nodiscard]] virtual std::optional<std::int64_t> ticks() const { return {}; }
  [[nodiscard]] virtual VideoClaims claims() const { return {}; }
};

/// The only frame of an image file.
Result<Image> read_image(const std::filesystem::path& path);

}  // namespace emberlock::session
