// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "base/frame.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "daemon/board.h"

namespace emberlock::daemon {

struct PicturesOptions {
  int width = 480;   ///< maximum in pixels; the height follows
  Hertz rate{12};    ///< maximum per camera, up to 15
  int quality = 75;  ///< JPEG quality, 1..100
};

/// Small JPEGs of the cameras' frames, put on the board while anyone wants them. Each frame is encoded at
/// most once for all watchers, by one thread that takes the newest frame of each camera in turn; if it is too
/// slow, pictures come less often.
class Pictures {
 public:
  static constexpr Hertz kFastest{15};

  Pictures(Board& board, PicturesOptions options);
  Pictures(const Pictures&) = delete;
  Pictures& operator=(const Pictures&) = delete;
  ~Pictures();

  /// The camera's newest frame. Any thread; returns at once, and keeps the frame's pixels for a while.
  void offer(const std::string& camera_id, const Frame& frame);

 private:
  struct Camera {
    Frame newest;   ///< without an image if there is no new frame
    TimePoint due;  ///< of the next picture
  };
  void make();
  [[nodiscard]] Camera* next(TimePoint now, std::string& id);

  Board& board_;
  const PicturesOptions options_;
  const Seconds apart_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::string, Camera> cameras_;
  bool ending_ = false;
  std::thread thread_;
};

/// The size in which a frame is shown in at most `width` columns; a Bayer mosaic in half of its own.
ImageSize shown_size(const ImageLayout& layout, int width);

/// A frame's pixels as rgb8 in that size: grey thrice, deep samples by their upper eight bits. Error
/// bad_input: an image without pixels, or of another layout than `size` follows from.
Result<Image> small_rgb8(const std::string& camera_id, const Frame& frame, ImageSize size);

/// Encodes a frame as a JPEG of at most `width` columns: grey as grey, Bayer mosaics and RGB in colour, deep
/// samples by their upper eight bits. Error bad_input: an image without pixels.
Result<v1::Picture> make_picture(const std::string& camera_id, const Frame& frame,
                                 const PicturesOptions& options);

}  // namespace emberlock::daemon
