// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "session/video_display.h"

namespace emberlock::session {

/// Writes a video of a constant frame rate, 8 bits. `key_interval`: at most so many frames from one that
/// stands by itself to the next; the encoder's own choice where 0.
class VideoWriter {
 public:
  enum class Coding {
    for_players,  ///< any can show it: MP4 with H.264 if libav has its encoder, else MPEG-4; odd sides lose
                  ///< one pixel
    lossless,     ///< Matroska with FFV1 (RFC 9043), R, G and B as they are; of rgb8 pictures
  };
  static Result<std::unique_ptr<VideoWriter>> create(const std::filesystem::path& path,
                                                     const ImageLayout& layout, Hertz frame_rate,
                                                     int key_interval = 0,
                                                     Coding coding = Coding::for_players,
                                                     const VideoDisplay& display = {});
  /// Whether videos of this coding hold a display matrix.
  [[nodiscard]] static bool holds_matrix(Coding coding) { return coding == Coding::for_players; }
  VideoWriter(const VideoWriter&) = delete;
  VideoWriter& operator=(const VideoWriter&) = delete;
  ~VideoWriter();

  /// The image must have the video's layout.
  Status show(const Image& image);
  /// Repeats the last image, with a hatched bar at its lower edge. For players alone.
  Status repeat();
  Status close();
  [[nodiscard]] std::string codec() const;

 private:
  struct Libav;
  VideoWriter(ImageLayout layout, std::unique_ptr<Libav> av);
  Status send();
  Status drain();

  ImageLayout layout_;
  std::unique_ptr<Libav> av_;
  std::int64_t shown_ = 0;
};

}  // namespace emberlock::session
