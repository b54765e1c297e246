// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

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

/// Frames of a foreign file: pictures (PGM, PPM, PNG, JPEG, TIFF, FITS) or a video that FFmpeg reads. A file
/// may hold several pictures: the pages of a TIFF, the views of an MPO, JPEGs or PNMs one behind the other.
/// Grey stays grey, colour becomes rgb8 or rgb16; a picture with alpha becomes what it shows over black
/// (colour times alpha). A film's alpha has no stated meaning, so frames that aren't opaque are an error.
/// 10..16-bit samples keep their values; bit_depth comes from the file's maximum value (a PGM with maxval
/// 4095 has 12 bits).
class FrameFile {
 public:
  /// Errors name the file and the fault (absent, truncated, not an image or video, no frames).
  static Result<std::unique_ptr<FrameFile>> open(const std::filesystem::path& path,
                                                 Colours colours = Colours::keep);
  virtual ~FrameFile() = default;
  /// The next frame; `out_of_data` after the last, `bad_input` where the file is damaged.
  virtual Result<Image> next() = 0;
  /// Passes over frames without converting them. Errors: as those of next().
  virtual Status skip(std::int64_t frames) = 0;
  /// Positions next() at the frame with this time stamp, in the file's ticks (`VideoScan::ticks`). If the
  /// video's index leads to another place, the file is decoded from its start. Errors: bad_input (no video),
  /// or those of opening.
  virtual Status seek(std::int64_t ticks);
  /// The time stamp of the frame that next() or skip() took last; nullopt if the file has none for it.
  [[nodiscard]] virtual std::optional<std::int64_t> ticks() const { return {}; }
  [[nodiscard]] virtual VideoClaims claims() const { return {}; }
  /// Number of pictures in a file without time stamps; 0: a video.
  [[nodiscard]] virtual std::int64_t pictures() const { return 0; }
  /// Fields that change how viewers show the file and that aren't applied here, one clause each: rows and
  /// columns stay the sensor's.
  [[nodiscard]] virtual std::vector<std::string> unapplied() const { return {}; }
};

/// Reads an image file with one frame. `unapplied` receives FrameFile::unapplied(). Errors (bad_input): those
/// of opening and decoding; several pictures.
Result<Image> read_image(const std::filesystem::path& path, std::vector<std::string>* unapplied = nullptr);

}  // namespace emberlock::session
