// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::session {

/// A video file that any player shows: MP4 with H.264 where libav has its encoder, else MPEG-4; 8 bits, a
/// constant frame rate. Sides are cut to even numbers of pixels.
class PlayerVideo {
 public:
  static Result<std::unique_ptr<PlayerVideo>> create(const std::filesystem::path& path,
                                                     const ImageLayout& layout, Hertz frame_rate);
  PlayerVideo(const PlayerVideo&) = delete;
  PlayerVideo& operator=(const PlayerVideo&) = delete;
  ~PlayerVideo();

  /// The image has the video's layout.
  Status show(const Image& image);
  /// The last image again.
  Status repeat();
  Status close();
  [[nodiscard]] std::string codec() const;

 private:
  struct Libav;
  PlayerVideo(ImageLayout layout, std::unique_ptr<Libav> av);
  Status drain();

  ImageLayout layout_;
  std::unique_ptr<Libav> av_;
  std::int64_t shown_ = 0;
};

}  // namespace emberlock::session
