// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "drivers/camera.h"

namespace emberlock::drivers::aravis {

/// What became of a frame.
enum class Fate { delivered, damaged, camera_gap, transport, resend, underrun, passed_over };

/// Gives each frame of a camera a running number, and counts what became of each: the number that comes next
/// is the sum of all counts. Cameras number frames with 16 bits (GigE Vision: 1 .. 65535, then 1 again) or
/// with 64, and begin anew at every start.
class FrameLedger {
 public:
  /// The frame that the camera numbers `id`, in the camera's order. Numbers skipped before it meet `gap`, but
  /// for those that unnumbered() spoke of; of an underrun those too. Returns its running number, without
  /// wraps or new beginnings.
  std::uint64_t record(std::uint64_t id, Fate fate, Fate gap = Fate::camera_gap);
  /// A frame of which came a part, but not the part that says its number.
  void unnumbered(Fate fate) { unnumbered_.push_back(fate); }
  /// The camera's next count begins anew, without a gap.
  void begin_anew();

  [[nodiscard]] const FrameCounts& counts() const { return counts_; }
  [[nodiscard]] std::uint64_t next_number() const { return next_; }

 private:
  void count(Fate fate, std::uint64_t frames = 1);

  FrameCounts counts_;
  std::uint64_t next_ = 0;
  std::optional<std::uint64_t> last_id_;
  std::vector<Fate> unnumbered_;  ///< since last_id_
};

}  // namespace emberlock::drivers::aravis
