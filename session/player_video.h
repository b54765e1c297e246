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

/// Writes a video that any player can show: MP4 with H.264 if libav has its encoder, else MPEG-4; 8 bits,
/// constant frame rate. Odd sides lose one pixel. `key_interval`: at most so many frames from one that stands
/// by itself to the next; the encoder's own choice where 0.
class PlayerVideo {
 public:
  static Result<std::unique_ptr<PlayerVideo>> create(const std::filesystem::path& path,
                                                     const ImageLayout& layout, Hertz frame_rate,
                                                     int key_interval = 0);
  PlayerVideo(const PlayerVideo&) = delete;
  PlayerVideo& operator=(const PlayerVideo&) = delete;
  ~PlayerVideo();

  /// The image must have the video's layout.
  Status show(const Image& image);
  /// Repeats the last image, with a hatched bar at its lower edge.
  Status repeat();
  Status close();
  [[nodiscard]] std::string codec() const;

 private:
  struct Libav;
  PlayerVideo(ImageLayout layout, std::unique_ptr<Libav> av);
  Status send();
  Status drain();

  ImageLayout layout_;
  std::unique_ptr<Libav> av_;
  std::int64_t shown_ = 0;
};

}  // namespace emberlock::session
