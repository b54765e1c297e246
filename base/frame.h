// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>

#include "base/image.h"
#include "base/time_point.h"

namespace emberlock {

enum class FrameStatus : std::uint8_t {
  complete,
  damaged,  ///< delivered, but the transport or a checksum reports missing or wrong pixels
};

/// Identity and times of a frame. It has three times: the camera's own clock (unknown origin), the wall clock
/// (since 1970-01-01 UTC) and the host's monotonic clock, both at arrival.
struct FrameStamp {
  std::uint64_t frame_id = 0;  ///< counted by the camera; a gap is a frame that wasn't delivered
  TimePoint device_time;
  TimePoint system_time;
  TimePoint monotonic_time;
  FrameStatus status = FrameStatus::complete;
  friend bool operator==(const FrameStamp&, const FrameStamp&) = default;
};

/// A frame as a camera or a recording delivers it. The pixels are shared and immutable.
struct Frame {
  FrameStamp stamp;
  std::shared_ptr<const Image> image;
};

}  // namespace emberlock
