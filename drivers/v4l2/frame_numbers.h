// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::drivers {

/// Converts a stream's sequence numbers, which restart at each start, to frame ids that never restart, and
/// counts missing frames. A skip in the sequence counts only as far as the elapsed time confirms it, because
/// uvcvideo has counted single frames as two or more.
class FrameNumbers {
 public:
  /// `nominal` is the camera's frame period. If it is 0 (unknown), every skip counts.
  explicit FrameNumbers(Seconds nominal) : period_(nominal) {}

  struct Number {
    std::uint64_t frame_id = 0;
    std::uint64_t missing = 0;  ///< between the previous frame and this one
  };

  /// Records the next frame. `at` is the device's time of it.
  Number next(std::uint32_t sequence, TimePoint at);
  /// The camera restarts its sequence; the frame ids continue.
  void restart() { started_ = false; }

 private:
  Seconds period_;  ///< measured, slowly adapting
  bool started_ = false;
  std::uint32_t sequence_ = 0;
  TimePoint at_;
  std::uint64_t next_id_ = 0;
};

}  // namespace emberlock::drivers
