// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "base/image.h"
#include "base/time_point.h"

namespace emberlock {

enum class FrameStatus : std::uint8_t {
  complete,
  damaged,  ///< delivered, but the transport or the checksum says that pixels are missing or wrong
};

/// When and as what a frame came. The three clocks are the camera's own (its origin unknown), the wall clock
/// (since 1970-01-01 UTC) and the host's monotonic clock at arrival.
struct FrameStamp {
  std::uint64_t frame_id = 0;  ///< the camera's own count; a gap is a frame not delivered
  TimePoint device_time;
  TimePoint system_time;
  TimePoint monotonic_time;
  FrameStatus status = FrameStatus::complete;
  friend bool operator==(const FrameStamp&, const FrameStamp&) = default;
};

/// One frame as a camera or a recording delivers it. The pixels are shared and never change.
struct Frame {
  FrameStamp stamp;
  std::shared_ptr<const Image> image;
};

}  // namespace emberlock
