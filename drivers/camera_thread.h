// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "drivers/camera.h"

namespace emberlock::drivers {

struct CameraThreadOptions {
  std::size_t queue_frames = 64;      ///< frames that wait to be taken; beyond it the oldest is lost. >= 1
  Seconds retry = milliseconds(250);  ///< between two looks for a camera that went away, > 0
  Seconds call_deadline =
      kCallDeadline * 1.5;  ///< what a call may take before the camera is held to hang, > 0
  /// Whether start() fails while the camera isn't there, or has it looked for as one that went away.
  enum class Absent { fails, is_looked_for } absent = Absent::fails;
  /// Shown every frame as it comes, also those that nobody takes. Called on the camera's thread; must return
  /// at once.
  std::function<void(const Frame&)> on_frame = {};
};

/// A camera that is driven by a thread of its own, behind the same interface. What it adds:
/// - frames are taken as they come and wait in a queue with a bound;
/// - a camera that goes away is looked for until it is back, and films on. next_frame says `device` once when
///   it goes, and `timed_out` while it is away;
/// - no call takes longer than that deadline, whatever the camera does. One that hangs is quarantined: every
///   call says `device` at once, until the hanging one returns. Destroyed meanwhile, thread and camera are
///   left behind, and end by themselves should they ever return.
/// reset_shutter() returns at once, and frames are passed over until it is done; an error of it comes from
/// next_frame. Frames that wait in the queue are in none of the counts. What a camera says of itself once it
/// has come is adopted by start() and next_frame(). One owner thread, but for state(), trouble() and
/// counts(), which any may ask. On the machine's monotonic clock.
class CameraThread final : public Camera {
 public:
  enum class State {
    idle,
    filming,
    lost,         ///< it went away, and is being looked for
    quarantined,  ///< it hangs
    ended,        ///< the recording that it replays is over: next_frame says out_of_data from now on
  };

  explicit CameraThread(std::unique_ptr<Camera> camera, CameraThreadOptions options = {});
  ~CameraThread() override;
  CameraThread(const CameraThread&) = delete;
  CameraThread& operator=(const CameraThread&) = delete;

  [[nodiscard]] State state() const;
  /// Why it is lost or quarantined.
  [[nodiscard]] std::optional<Error> trouble() const;

  [[nodiscard]] const CameraInfo& info() const override;
  [[nodiscard]] FrameCounts counts() const override;
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

 private:
  class Worker;
  std::shared_ptr<Worker> worker_;  ///< shared with the thread, which may outlive this
};

}  // namespace emberlock::drivers
