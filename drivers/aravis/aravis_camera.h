// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"
#include "drivers/aravis/frame_ledger.h"
#include "drivers/aravis/link.h"
#include "drivers/camera.h"
#include "drivers/driver.h"

namespace emberlock::drivers::aravis {

/// A GigE Vision or USB3 Vision camera. Library calls that may hang run on a thread of their own, which is
/// left behind when one hangs: this camera then returns `device` until that call has returned; other cameras
/// aren't affected. A shutter reset is AcquisitionStop and AcquisitionStart; it waits for its instant, which
/// may be at most kLongestReset ahead. Times are on the machine's monotonic clock.
class AravisCamera final : public Camera {
 public:
  static constexpr Seconds kLongestReset = milliseconds(500);

  /// The link may be filming or not. `request` restores the settings after the camera was lost.
  AravisCamera(std::string id, CameraRequest request, std::shared_ptr<Link> link);
  ~AravisCamera() override;

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return ledger_.counts(); }
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  /// Always error device: GenICam has no standard feature for the steps of a frame rate.
  Status trim_rate(PartsPerMillion trim) override;

 private:
  using Linked = Result<std::shared_ptr<Link>>;

  [[nodiscard]] Error failure(std::string what, std::string remedy) const;
  std::optional<Arrived> next_arrived(Seconds deadline);
  /// Counts the frame and returns it if it is to be handed on.
  std::optional<Frame> hand_on(Arrived arrived);
  /// Drops frames that arrived before an instant.
  std::uint64_t pass_over_before(TimePoint instant);
  /// Call this before a buffer is given back.
  void note_drought();
  void drop(Arrived arrived, FrameOutcome outcome);
  std::uint64_t record(std::optional<std::uint64_t> frame_id, TimePoint came, FrameOutcome outcome);
  /// Whether the camera is gone: it sends nothing and doesn't answer a query.
  [[nodiscard]] bool silent();
  /// Runs a library call on its own thread. nullopt if it takes too long: the camera is then quarantined and
  /// the link is left to that thread.
  template <class T>
  std::optional<T> bounded(Seconds deadline, std::function<T(Link&)> call);
  /// Closes the link on its own thread, because that may hang; waits until the deadline.
  void let_go(Seconds deadline);
  Error lose(std::string what);

  std::string id_;
  CameraRequest request_;
  CameraInfo info_;
  SteadyClock clock_;
  FrameLedger ledger_;
  std::shared_ptr<Link> link_;  ///< null while the camera is lost or hangs
  bool filming_ = false;
  std::optional<std::future<Linked>> starting_;       ///< a start that hasn't been answered yet
  std::shared_ptr<const std::atomic<bool>> hanging_;  ///< becomes true when the hanging call has returned
  TimePoint hangs_since_;
  std::optional<Arrived> held_;  ///< popped, but not handed on yet
  TimePoint wanted_from_;        ///< earlier frames show an older shutter phase
  TimePoint device_time_;        ///< of the last frame
  TimePoint last_sign_;          ///< last time that anything came from the camera
  TimePoint next_question_;      ///< next query of a silent camera
  std::optional<TimePoint> unanswered_since_;
  std::uint64_t signs_ = 0;
  TimePoint last_came_;                   ///< arrival of the last frame
  std::deque<TimePoint> droughts_ended_;  ///< times at which a stream without free buffers got one
};

}  // namespace emberlock::drivers::aravis
