// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "base/time_point.h"
#include "daemon/engine/machine.h"
#include "drivers/camera.h"
#include "session/async_writer.h"

namespace emberlock::daemon {

/// What is counted of the machine's work.
struct WorkCounts {
  std::vector<drivers::FrameCounts> cameras;  ///< since each was opened
  std::uint64_t no_room = 0;     ///< frames for which the recording's queues had no room, of all recordings
  session::WriterLoad writer{};  ///< of the recording under way
  int overworked = 0;            ///< cameras whose threads compute for longer than they may
};

/// Tells which part of the machine is overloaded from what frames are lost to: the processor (frames weren't
/// fetched or encoded in time), the disk (the recording's writers wait for it), or the cameras' bus. One
/// fault a cause, whatever the number of cameras. Pure but for what it remembers.
class OverloadWatch {
 public:
  /// What was lost within so long counts; without a loss for so long a fault is over.
  static constexpr Seconds kSpan{10};
  /// Between two samples.
  static constexpr Seconds kInterval{0.5};
  /// Fewer frames, or a smaller part of all, are no overload.
  static constexpr std::uint64_t kFewest = 5;
  static constexpr double kLeastPart = 0.002;

  explicit OverloadWatch(std::size_t cameras) : lately_(cameras, 0) {}

  std::vector<MachineEvent> look(const WorkCounts& counts, TimePoint now);

  /// Frames of a camera that were lost within kSpan, whatever the cause.
  [[nodiscard]] std::uint64_t lost_lately(std::size_t camera) const { return lately_[camera]; }

 private:
  static constexpr std::size_t kCauses = static_cast<std::size_t>(Bottleneck::last) + 1;
  using Losses = std::array<std::uint64_t, kCauses>;
  struct Sample {
    TimePoint at;
    WorkCounts counts;
    Losses lost{};  ///< since the first sample, by cause
  };

  std::deque<Sample> samples_;
  std::vector<std::uint64_t> lately_;
  std::array<bool, kCauses> told_{};
};

}  // namespace emberlock::daemon
