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
  std::size_t queue_frames = 64;  ///< capacity of the queue; when it is full the oldest frame is lost. >= 1
  Seconds retry = milliseconds(250);            ///< interval between two searches for a lost camera, > 0
  Seconds call_deadline = kCallDeadline * 1.5;  ///< a call that takes longer counts as hanging, > 0
  /// How long before its instant a reset is passed to the camera, >= 0.
  Seconds reset_ahead = milliseconds(5);
  /// What start() does while the camera is absent: it fails, or it searches for the camera as if it had been
  /// lost.
  enum class Absent { fails, is_looked_for } absent = Absent::fails;
  /// Called with every frame on arrival, also with frames that are never fetched. Runs on the camera's
  /// thread; must return at once.
  std::function<void(const Frame&)> on_frame = {};
};

/// A camera that is driven by its own thread, behind the same interface. In addition:
/// - frames are fetched on arrival and wait in a bounded queue;
/// - a lost camera is searched for until it is back and then films again. next_frame returns `device`
///   once when it is lost, and `timed_out` while it is away;
/// - no call takes longer than its deadline, whatever the camera does. A hanging camera is quarantined: every
///   call returns `device` at once until the hanging call returns. One whose thread computes meanwhile
///   doesn't hang: the processor is overloaded. If this object is destroyed meanwhile, thread and camera are
///   left running; they end if the call ever returns.
/// reset_shutter() returns at once; frames are skipped until the reset is done, and next_frame returns its
/// error. Queued frames are in none of the counts; those that a sink takes are counted as next_frame() counts
/// them. start() and next_frame() update info() when a camera has
/// come back. One owner thread, except state(), overworked(), trouble() and counts(), which any thread may
/// call. Uses the machine's monotonic clock.
class CameraThread final : public Camera {
 public:
  enum class State {
    idle,
    filming,
    lost,         ///< disappeared, and is being searched for
    quarantined,  ///< a call hangs
    ended,        ///< the end of a replayed recording: next_frame returns out_of_data from now on
  };

  explicit CameraThread(std::unique_ptr<Camera> camera, CameraThreadOptions options = {});
  ~CameraThread() override;
  CameraThread(const CameraThread&) = delete;
  CameraThread& operator=(const CameraThread&) = delete;

  [[nodiscard]] State state() const;
  /// A call takes longer than its deadline, but the thread computes: the processor has too much to do.
  [[nodiscard]] bool overworked() const;
  /// Why the camera is lost or quarantined.
  [[nodiscard]] std::optional<Error> trouble() const;

  [[nodiscard]] const CameraInfo& info() const override;
  [[nodiscard]] FrameCounts counts() const override;
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;
  /// From now on frames go to `sink`, on the camera's thread, instead of into the queue: those that wait
  /// there first. An empty sink: into the queue again. Returns the counts at that instant: what is counted as
  /// delivered or damaged after it went to the sink, and after the next call it goes there no more.
  FrameCounts feed(FrameSink sink);

 private:
  class Worker;
  std::shared_ptr<Worker> worker_;  ///< shared with the thread, which may outlive this object
};

}  // namespace emberlock::drivers
