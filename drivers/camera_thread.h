#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "drivers/camera.h"

namespace emberlock {

struct CameraThreadOptions {
  std::size_t queue_frames = 64;      ///< frames that wait to be taken; beyond it the oldest is lost. >= 1
  Seconds retry = milliseconds(250);  ///< between two looks for a camera that went away, > 0
  Seconds call_deadline =
      kCallDeadline * 1.5;  ///< what a call may take before the camera is held to hang, > 0
};

/// A camera that is driven by a thread of its own, behind the same interface. What it adds:
/// - frames are taken as they come and wait in a queue with a bound;
/// - a camera that goes away is looked for until it is back, and films on. next_frame says `device` once when
///   it goes, and `timed_out` while it is away;
/// - no call takes longer than that deadline, whatever the camera does. One that hangs is quarantined: every
///   call says `device` at once, until the hanging one returns. Destroyed meanwhile, thread and camera are
///   left behind, and end by themselves should they ever return.
/// reset_shutter() returns at once, and frames are passed over until it is done; an error of it comes from
/// next_frame. Frames that wait in the queue are in none of the counts. One owner thread, but for state() and
/// counts(), which any may ask. On the machine's monotonic clock.
class CameraThread final : public Camera {
 public:
  enum class State {
    idle,
    filming,
    lost,         ///< it went away, and is being looked for
    quarantined,  ///< it hangs
  };

  explicit CameraThread(std::unique_ptr<Camera> camera, CameraThreadOptions options = {});
  ~CameraThread() override;
  CameraThread(const CameraThread&) = delete;
  CameraThread& operator=(const CameraThread&) = delete;

  [[nodiscard]] State state() const;

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

}  // namespace emberlock
