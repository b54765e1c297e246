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

/// A GigE Vision or USB3 Vision camera. What of the library may hang runs on a thread that is left behind
/// when it does: the camera then says `device` until that call has returned, and the others film on.
/// A reset of the shutter is AcquisitionStop and AcquisitionStart; it waits for its instant, at most
/// kLongestReset ahead. Times are on the machine's monotonic clock.
class AravisCamera final : public Camera {
 public:
  static constexpr Seconds kLongestReset = milliseconds(500);

  /// The link is filming or not; `request` sets the camera up again after it was lost.
  AravisCamera(std::string id, CameraRequest request, std::shared_ptr<Link> link);
  ~AravisCamera() override;

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return ledger_.counts(); }
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  /// Error device always: no standard feature says in which steps a rate can be set.
  Status trim_rate(PartsPerMillion trim) override;

 private:
  using Linked = Result<std::shared_ptr<Link>>;

  [[nodiscard]] Error failure(std::string what, std::string remedy) const;
  std::optional<Arrived> next_arrived(Seconds deadline);
  /// The frame, if it is to be handed on; counts it whatever it is.
  std::optional<Frame> hand_on(Arrived arrived);
  /// Frames that came before an instant.
  std::uint64_t pass_over_before(TimePoint instant);
  /// To be called before a buffer is given back.
  void note_drought();
  void drop(Arrived arrived, Fate fate);
  std::uint64_t record(std::optional<std::uint64_t> frame_id, TimePoint came, Fate fate);
  /// Whether it went away: it sends nothing, and doesn't answer when it is asked for something.
  [[nodiscard]] bool silent();
  /// Calls the library on a thread of its own. None if that takes longer: the camera is quarantined then, the
  /// link left to that thread.
  template <class T>
  std::optional<T> bounded(Seconds deadline, std::function<T(Link&)> call);
  /// Closes the link on a thread of its own, as that may hang, and waits for it until the deadline.
  void let_go(Seconds deadline);
  Error lose(std::string what);

  std::string id_;
  CameraRequest request_;
  CameraInfo info_;
  SteadyClock clock_;
  FrameLedger ledger_;
  std::shared_ptr<Link> link_;  ///< none while the camera is lost, or hangs
  bool filming_ = false;
  std::optional<std::future<Linked>> starting_;       ///< a start that nobody has the answer of yet
  std::shared_ptr<const std::atomic<bool>> hanging_;  ///< true once the call that hung has returned
  TimePoint hangs_since_;
  std::optional<Arrived> held_;  ///< popped, but not taken yet
  TimePoint wanted_from_;        ///< frames that came before it are of an older shutter phase
  TimePoint device_time_;        ///< of the last frame
  TimePoint last_sign_;          ///< when something last came from the camera
  TimePoint next_question_;      ///< to a camera that is silent
  std::optional<TimePoint> unanswered_since_;
  std::uint64_t signs_ = 0;
  TimePoint last_came_;                   ///< the last frame
  std::deque<TimePoint> droughts_ended_;  ///< when a stream without a buffer got one
};

}  // namespace emberlock::drivers::aravis
