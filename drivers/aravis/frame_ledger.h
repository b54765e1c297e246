// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera.h"

namespace emberlock::drivers::aravis {

/// The outcome of a frame.
enum class FrameOutcome { delivered, damaged, camera_gap, transport, resend, underrun, passed_over };

/// Gives each frame of a camera a running number and counts the outcomes: the next number is the sum of all
/// counts. Cameras count frames with 16 bits (GigE Vision: 1 .. 65535, then 1 again) or 64 bits, and restart
/// at every start.
class FrameLedger {
 public:
  /// Records the frame with the camera's number `id`, in order. Skipped numbers before it get the outcome
  /// `gap`, except those reported by unnumbered(), which keep their own unless `gap` is an underrun. Returns
  /// the running number, which never wraps or restarts.
  std::uint64_t record(std::uint64_t id, FrameOutcome outcome, FrameOutcome gap = FrameOutcome::camera_gap);
  /// Records a frame whose number was lost; only other parts of it arrived.
  void unnumbered(FrameOutcome outcome) { unnumbered_.push_back(outcome); }
  /// The camera restarts its count, without a gap.
  void begin_anew();

  [[nodiscard]] const FrameCounts& counts() const { return counts_; }
  [[nodiscard]] std::uint64_t next_number() const { return next_; }

 private:
  void count(FrameOutcome outcome, std::uint64_t frames = 1);

  FrameCounts counts_;
  std::uint64_t next_ = 0;
  std::optional<std::uint64_t> last_id_;
  std::vector<FrameOutcome> unnumbered_;  ///< since last_id_
};

}  // namespace emberlock::drivers::aravis
