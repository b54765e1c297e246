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

/// Which action draws the phase of a camera's shutter anew: it differs by camera.
enum class ChdkReset {
  mode_toggle,  ///< to playback and back to recording, as with the paper's cameras
  movie,        ///< a movie is stopped and started; started and stopped where none runs
  power_cycle,  ///< by ChdkCameraOptions::power_command
};

/// What CameraRequest::controls can say of these cameras: "reset" = "mode", "movie" or "power", and
/// "power_command" = a command line (PowerCommand).
struct ChdkCameraOptions {
  ChdkReset reset = ChdkReset::mode_toggle;
  std::string power_command = {};  ///< ChdkReset::power_cycle needs it
};
/// Error bad_input: names the control and what it can be.
Result<ChdkCameraOptions> chdk_camera_options(const CameraRequest& request, const std::string& camera);

/// The fastest that frames are asked for: what old cameras' live view makes.
inline constexpr Hertz kLiveViewRate{30};

/// How a live view of that size can be handed on.
std::vector<CameraMode> chdk_modes(ImageSize size);

/// A Canon camera with CHDK, whose frames are its live view.
///
/// The live view has neither numbers nor times: a frame is made by asking for it, at the rate of the request,
/// and is what the camera shows at that moment. So `frame_id` counts the questions, a gap in it is one whose
/// answer was lost (counted as transport) or had another size (camera_gap), and a camera that answers slower
/// than it is asked films slower. All three times of a stamp are its arrival's.
///
/// Changes of mode take a second and more. start() and reset_shutter() begin them; next_frame() sees them to
/// their end, and says `device` where one hasn't ended within kChangeDeadline (kPowerDeadline for the power).
class ChdkCamera final : public Camera {
 public:
  static constexpr Seconds kChangeDeadline{3};
  static constexpr Seconds kPowerDeadline{20};

  /// Connects, enters record mode and looks at one picture; up to kChangeDeadline and 2 s. Errors: connect's;
  /// device (no CHDK, no live view); bad_input (the request).
  static Result<std::unique_ptr<ChdkCamera>> open(PtpConnect connect, const CameraRequest& request,
                                                  std::shared_ptr<Clock> clock);

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  /// Nothing waits here: a frame is made when it is asked for.
  std::uint64_t pass_over(TimePoint /*until*/) override { return 0; }
  /// Of the last one: frames come again only after what ChdkCameraOptions::reset says was seen through.
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

  /// A reset and what it took.
  struct Reset {
    TimePoint at;  ///< when the action began
    std::optional<TimePoint> first_frame = {};
  };
  [[nodiscard]] const std::optional<Reset>& last_reset() const { return last_reset_; }

  /// To film a movie onto the card meanwhile (clips.h), between calls of this camera; null while it is away.
  [[nodiscard]] PtpSession* session() { return session_.get(); }

 private:
  /// A change that the camera needs time for.
  enum class Step { play, record, movie_on, movie_off, power };

  ChdkCamera(PtpConnect connect, std::shared_ptr<Clock> clock)
      : connect_(std::move(connect)), clock_(std::move(clock)) {}

  Status connect();
  Chdk chdk() { return Chdk(*session_); }
  Status begin(Step step);
  /// Whether the step has come to its end.
  Result<bool> ended(Step step);
  Result<bool> power_cycled();
  /// Goes on with the steps, without waiting.
  Status advance();
  Status begin_reset();
  /// Ends the question that is under way, whose picture nobody wants.
  void drop_question();

  /// The frame that comes by `until`; none: ask again, something else is due.
  Result<std::optional<Frame>> fetch(TimePoint until);
  Result<std::optional<Frame>> lost_answer(Error error);
  Result<std::optional<LiveView>> picture_of(const PtpAnswer& answer);
  Frame frame_of(const LiveView& view);
  /// The camera is gone, or of no use any more.
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
  std::optional<TimePoint> step_since_;  ///< absent: the first one hasn't begun
  std::optional<PowerCommand> power_;
  std::optional<Reset> last_reset_;

  std::uint64_t next_id_ = 0;
  TimePoint next_question_;
  TimePoint last_picture_;  ///< or the start
  int lost_in_a_row_ = 0;
};

}  // namespace emberlock::drivers
