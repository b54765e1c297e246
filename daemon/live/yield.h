// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "base/quantity.h"
#include "base/time_point.h"
#include "daemon/live/reasons.h"

namespace emberlock::daemon {

/// How well a recording gets on.
struct RecordingLoad {
  double queue_fill = 0;    ///< 0..1, of the fullest queue
  Seconds at_risk{0};       ///< for how long the oldest frame has waited to be on the disk
  std::uint64_t lost = 0;   ///< frames, to too much work: for want of a buffer, to queue and disk
  bool overworked = false;  ///< some camera's thread computes for longer than it may
};

/// Decides whether volumes may be made beside a recording: they stand still as soon as it has trouble, long
/// before that costs it a frame, and end with the first frame that it loses. Pure but for what it remembers.
class LiveYield {
 public:
  enum class Verdict { run, pause, stop };
  /// They pause above this; the queue is full at 1.
  static constexpr double kPauseFill = 0.3;
  static constexpr double kCalmFill = 0.15;
  /// A sync every 0.2 s and flushes every 0.1 s leave frames waiting for up to 0.5 s on a good disk.
  static constexpr Seconds kPauseAtRisk{0.8};
  static constexpr Seconds kCalmAtRisk{0.6};
  /// Without trouble for so long they go on.
  static constexpr Seconds kCalm{1};
  /// They are ended when they have to pause more often.
  static constexpr int kMostPauses = 10;

  /// A verdict of `stop` stays.
  Verdict look(const RecordingLoad& load, TimePoint now);
  /// Of pause and stop.
  [[nodiscard]] const LiveReason& reason() const { return reason_; }

 private:
  Verdict end(LiveReason reason);

  Verdict verdict_ = Verdict::run;
  LiveReason reason_;
  std::optional<TimePoint> calm_since_;
  int pauses_ = 0;
};

}  // namespace emberlock::daemon
