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

/// What a video's metadata says. It isn't verified.
struct VideoClaims {
  std::optional<Hertz> frame_rate{};
  std::optional<std::int64_t> frames{};
};

/// How a video's colours are read. Codecs store brightness at full resolution and colours at a lower one.
enum class Colours {
  keep,
  brightness,  ///< only the brightness of a video that stores brightness and colour differences: faster
};

/// Frames of a foreign file: one image (PGM, PPM, PNG, JPEG, TIFF, FITS) or a video that FFmpeg reads. Grey
/// stays grey, colour becomes rgb8 or rgb16; an image with alpha becomes what it shows over black (colour
/// times alpha). 10..16-bit samples keep their values; bit_depth comes from the
/// file's maximum value (a PGM with maxval 4095 has 12 bits).
class FrameFile {
 public:
  /// Errors name the file and the fault (absent, truncated, not an image or video, no frames).
  static Result<std::unique_ptr<FrameFile>> open(const std::filesystem::path& path,
                                                 Colours colours = Colours::keep);
  virtual ~FrameFile() = default;
  /// The next frame; `out_of_data` after the last, `bad_input` where the file is damaged.
  virtual Result<Image> next() = 0;
  /// Positions next() at the frame with this time stamp, in the file's ticks (`VideoScan::ticks`). If the
  /// video's index leads to another place, the file is decoded from its start. Errors: bad_input (no video),
  /// or those of opening.
  virtual Status seek(std::int64_t ticks);
  /// The time stamp of the frame that next() returned last, for videos that have time stamps.
  [[nodiscard]] virtual std::optional<std::int64_t> ticks() const { return {}; }
  [[nodiscard]] virtual VideoClaims claims() const { return {}; }
};

/// Reads an image file with one frame.
Result<Image> read_image(const std::filesystem::path& path);

}  // namespace emberlock::session
