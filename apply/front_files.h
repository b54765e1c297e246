// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "apply/composite.h"
#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "session/media/frame_file.h"

namespace emberlock::apply {

/// What stands before the flame, from files: one picture for all frames, a folder of pictures, one a frame by
/// their names in natural order (9 before 10), or, of a mask, a video. A mask is white before the flame, grey
/// in part. A depth picture is grey of 16 bits, metres along the camera's axis by its unit, or OpenEXR's
/// channel Z, Y or R in metres; 0, and what isn't finite, isn't known.
class FrontFiles {
 public:
  struct Sources {
    std::optional<std::filesystem::path> mask = {}, depth = {};
    Meters depth_unit{0.001};  ///< of a level of 16 bits
  };
  /// Errors (bad_input): nothing there, fewer pictures than frames.
  static Result<FrontFiles> open(const Sources& sources, ImageSize size, std::int64_t frames);

  /// Of the next frame. Errors (bad_input): a picture that can't be read, of another size or kind; they name
  /// it.
  Result<InFront> next();
  /// Reads all once, so that what is wrong with them is known. Errors: those of next().
  Status check();

 private:
  /// The files of the one kind.
  struct Pictures {
    std::vector<std::filesystem::path> files;
    bool video = false;
  };
  static Result<Pictures> pictures_of(const std::filesystem::path& path, const char* option,
                                      std::int64_t frames);
  [[nodiscard]] Result<Image> mask_image();
  [[nodiscard]] Result<std::vector<float>> depth_of(const std::filesystem::path& file) const;
  Status size_is_right(ImageSize size, const std::filesystem::path& file) const;

  Sources sources_;
  ImageSize size_;
  std::int64_t frames_ = 0, at_ = 0;
  Pictures mask_, depth_;
  std::shared_ptr<session::FrameFile> video_;
  InFront last_;
};

}  // namespace emberlock::apply
