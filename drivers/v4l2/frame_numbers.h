// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::drivers {

/// Turns the sequence numbers of a stream, which begin anew at each start, into frame ids that never do, and
/// tells how many frames are missing between two. A skip of the sequence is believed as far as time has
/// passed for it: uvcvideo has counted single frames as two or more.
class FrameNumbers {
 public:
  /// `nominal` is the camera's frame period; 0 where it is unknown: then the sequence is believed.
  explicit FrameNumbers(Seconds nominal) : period_(nominal) {}

  struct Number {
    std::uint64_t frame_id = 0;
    std::uint64_t missing = 0;  ///< between the frame before and this one
  };

  /// The next frame that came; `at` is the device's time of it.
  Number next(std::uint32_t sequence, TimePoint at);
  /// The camera starts anew: what it counts from there on follows on what it counted before.
  void restart() { started_ = false; }

 private:
  Seconds period_;  ///< as seen, slowly following
  bool started_ = false;
  std::uint32_t sequence_ = 0;
  TimePoint at_;
  std::uint64_t next_id_ = 0;
};

}  // namespace emberlock::drivers
