// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "drivers/driver.h"
#include "drivers/ptp/chdk.h"
#include "drivers/ptp/connection.h"
#include "drivers/ptp/live_view.h"
#include "drivers/ptp/power_command.h"

namespace emberlock::drivers {

/// The action that resets the phase of a camera's shutter. It depends on the camera model.
enum class ChdkReset {
  mode_toggle,  ///< to playback and back to record mode, as with the paper's cameras
  movie,        ///< stops and starts a movie; starts and stops one if none is running
  power_cycle,  ///< runs ChdkCameraOptions::power_command
};

/// Options from CameraRequest::controls: "reset" = "mode", "movie" or "power", and "power_command" = a
/// command line (PowerCommand).
struct ChdkCameraOptions {
  ChdkReset reset = ChdkReset::mode_toggle;
  std::string power_command = {};  ///< required by ChdkReset::power_cycle
};
/// Error bad_input: names the control and its valid values.
Result<ChdkCameraOptions> chdk_camera_options(const CameraRequest& request, const std::string& camera);

/// The highest rate at which frames are requested: the live view rate of old cameras.
inline constexpr Hertz kLiveViewRate{30};

/// The modes for a live view of this size.
std::vector<CameraMode> chdk_modes(ImageSize size);

/// A Canon camera with CHDK. Its frames are pictures of the live view.
///
/// The live view has neither frame numbers nor times. A frame is taken when it is requested, at the rate of
/// the CameraRequest, and shows what the camera displays at that moment. So `frame_id` counts the requests; a
/// gap is a request whose answer was lost (counted as transport) or had another size (camera_gap). A camera
/// that answers more slowly than the requested rate films more slowly. All three times of a stamp are the
/// arrival time.
///
/// Mode changes take a second or more. start() and reset_shutter() start them; next_frame() completes them,
/// and returns `device` if one takes longer than kChangeDeadline (kPowerDeadline for a power cycle).
class ChdkCamera final : public Camera {
 public:
  static constexpr Seconds kChangeDeadline{3};
  static constexpr Seconds kPowerDeadline{20};

  /// Connects, enters record mode and reads one picture; takes up to kChangeDeadline plus 2 s. Errors: those
  /// of `connect`; device (no CHDK, no live view); bad_input (the request).
  static Result<std::unique_ptr<ChdkCamera>> open(PtpConnect connect, const CameraRequest& request,
                                                  std::shared_ptr<Clock> clock);

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  /// No frames are queued: a frame is taken when it is requested.
  std::uint64_t pass_over(TimePoint /*until*/) override { return 0; }
  /// Frames come again only after the action in ChdkCameraOptions::reset is complete.
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

  /// A reset and its duration.
  struct Reset {
    TimePoint at;  ///< start of the action
    std::optional<TimePoint> first_frame = {};
  };
  [[nodiscard]] const std::optional<Reset>& last_reset() const { return last_reset_; }

  /// For recording a movie onto the card meanwhile (clips.h), between calls of this camera; null while the
  /// camera is away.
  [[nodiscard]] PtpSession* session() { return session_.get(); }

 private:
  /// A state change for which the camera needs time.
  enum class Step { play, record, movie_on, movie_off, power };

  ChdkCamera(PtpConnect connect, std::shared_ptr<Clock> clock)
      : connect_(std::move(connect)), clock_(std::move(clock)) {}

  Status connect();
  Chdk chdk() { return Chdk(*session_); }
  Status begin(Step step);
  /// Whether the step is complete.
  Result<bool> ended(Step step);
  Result<bool> power_cycled();
  /// Continues the pending steps without blocking.
  Status advance();
  Status begin_reset();
  /// Ends the pending request; its picture isn't used.
  void drop_question();

  /// The frame that arrives before `until`; nullopt: call again, because something else is due first.
  Result<std::optional<Frame>> fetch(TimePoint until);
  Result<std::optional<Frame>> lost_answer(Error error);
  Result<std::optional<LiveView>> picture_of(const PtpAnswer& answer);
  Frame frame_of(const LiveView& view);
  /// The camera is gone or unusable.
  Error lose(Error error);
  [[nodiscard]] Error refuse(std::string what, std::string remedy) const;
  [[nodiscard]] Error late(Seconds deadline) const;

  PtpConnect connect_;
  std::shared_ptr<Clock> clock_;
  CameraInfo info_;
  ChdkCameraOptions options_;
  std::unique_ptr<PtpSession> session_;
  FrameCounts counts_;
  bool filming_ = false;

  std::deque<Step> steps_;
  std::optional<TimePoint> step_since_;  ///< absent: the first step hasn't begun
  std::optional<PowerCommand> power_;
  std::optional<Reset> last_reset_;

  std::uint64_t next_id_ = 0;
  TimePoint next_question_;
  TimePoint last_picture_;  ///< or of the start
  int lost_in_a_row_ = 0;
};

}  // namespace emberlock::drivers
