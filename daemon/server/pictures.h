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
  int width = 480;   ///< pixels at most; height follows
  Hertz rate{12};    ///< of each camera at most, up to 15
  int quality = 75;  ///< JPEG's, 1..100
};

/// Small JPEGs of what cameras film, on the board while anybody wants them. Each frame is made into one at
/// most, for all watchers, by one thread that takes the newest of each camera in turn: if it can't keep up,
/// pictures come less often.
class Pictures {
 public:
  static constexpr Hertz kFastest{15};

  Pictures(Board& board, PicturesOptions options);
  Pictures(const Pictures&) = delete;
  Pictures& operator=(const Pictures&) = delete;
  ~Pictures();

  /// The camera's newest frame. From any thread; returns at once, and holds on to the frame's pixels a while.
  void offer(const std::string& camera_id, const Frame& frame);

 private:
  struct Camera {
    Frame newest;   ///< without an image: none since the last
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

/// A frame as a JPEG of at most `width` pixels a row: grey as grey, Bayer mosaics and RGB in colour, deep
/// samples by their upper eight bits. Error bad_input: an image without pixels.
Result<v1::Picture> make_picture(const std::string& camera_id, const Frame& frame,
                                 const PicturesOptions& options);

}  // namespace emberlock::daemon
