// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <variant>

#include "base/quantity.h"
#include "daemon/reconstruction/state.h"

// Why live volumes pause, have ended, or don't keep up: codes with the numbers that they need.
// daemon/engine/words.h makes sentences of them.
namespace emberlock::daemon {

/// Of the newest frame, while there is no volume yet.
struct NoVolumeYet {
  std::string why;
};
struct QueueFills {
  double share = 0;  ///< of the recording's fullest queue
};
struct DiskBehind {
  Seconds waits;  ///< a frame, to be on the disk
};
struct CamerasOverworked {};
/// By the recording.
struct FramesLostBeside {
  std::uint64_t frames = 0;
};
struct PausedTooOften {
  int times = 0;
};
/// Wanted frames are overtaken.
struct TooSlow {
  Seconds takes;  ///< a volume
  std::uint64_t every = 0;
  std::uint32_t voxels = 0;
  std::uint64_t holds_every = 0;  ///< what would hold, as in v1::LiveStatus
  std::uint32_t holds_voxels = 0;
};
/// The process that makes them.
struct LiveChildFailed {
  ChildEnd end;
  std::string told;        ///< why, by itself
  std::string last_words;  ///< what it wrote to stderr
};

using LiveReason = std::variant<std::monostate, NoVolumeYet, QueueFills, DiskBehind, CamerasOverworked,
                                FramesLostBeside, PausedTooOften, TooSlow, LiveChildFailed>;

}  // namespace emberlock::daemon
