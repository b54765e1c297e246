// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "base/frame.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/sensor_kind.h"
#include "base/shutter.h"

namespace emberlock::drivers {

/// The event that a frame's device_time marks.
enum class DeviceTimeOf { unknown, exposure_start, frame_end };

struct CameraInfo {
  /// Stable identity: serial number, else USB path or MAC; never an index. A valid folder name (letters,
  /// digits, space and . _ : -).
  std::string id;
  std::string model;
  ImageLayout layout;
  Hertz frame_rate;  ///< nominal
  ShutterReset reset = ShutterReset::none;
  std::optional<FrameRateTrim> trim = {};  ///< absent: the rate can't be trimmed
  SensorKind sensor = SensorKind::ccd;
  DeviceTimeOf device_time_of = DeviceTimeOf::unknown;
  Seconds transport{
      0};  ///< upper bound of the time from a frame's last row to its arrival: delays in camera and bus
};

/// Outcomes of the frames that a camera produced since it was opened. Each frame is counted exactly once.
/// When the camera restarts its numbering after start() or a reset, no frames are added.
struct FrameCounts {
  std::uint64_t delivered = 0;    ///< handed on complete
  std::uint64_t damaged = 0;      ///< handed on with FrameStatus::damaged
  std::uint64_t camera_gap = 0;   ///< skipped frame numbers without another explanation
  std::uint64_t transport = 0;    ///< lost, completely or in part, by the bus or network
  std::uint64_t resend = 0;       ///< missing parts were requested again and never arrived
  std::uint64_t underrun = 0;     ///< the driver had no free buffer
  std::uint64_t queue = 0;        ///< not fetched in time: the queue was full
  std::uint64_t passed_over = 0;  ///< dropped on purpose by stop(), pass_over() or a reset

  [[nodiscard]] std::uint64_t lost() const { return camera_gap + transport + resend + underrun + queue; }
  [[nodiscard]] std::uint64_t made() const { return delivered + damaged + passed_over + lost(); }
  friend bool operator==(const FrameCounts&, const FrameCounts&) = default;
  /// What was counted between two looks.
  friend FrameCounts operator-(const FrameCounts& after, const FrameCounts& before) {
    return {after.delivered - before.delivered,   after.damaged - before.damaged,
            after.camera_gap - before.camera_gap, after.transport - before.transport,
            after.resend - before.resend,         after.underrun - before.underrun,
            after.queue - before.queue,           after.passed_over - before.passed_over};
  }
};

/// Maximum duration of a call that has no deadline argument.
inline constexpr Seconds kCallDeadline{2};

/// Takes a camera's frames as they come, with what the camera counts then. Returns at once, and doesn't call
/// the camera.
using FrameSink = std::function<void(const Frame& frame, const FrameCounts& counts)>;

/// An opened camera. One owner thread; not thread-safe. Times are on the host clock that was given to the
/// driver.
///
/// A camera that disappears (unplugged, control lost) reports this once, as error `device` of next_frame, and
/// stops filming. start() then searches for it by its id and restores its settings; it returns error `device`
/// until the camera is back. The object stays valid meanwhile. No call takes longer than its deadline, or
/// kCallDeadline.
class Camera {
 public:
  virtual ~Camera() = default;
  [[nodiscard]] virtual const CameraInfo& info() const = 0;
  [[nodiscard]] virtual FrameCounts counts() const = 0;

  /// Starts filming; frames are queued from now on. Error `device`: the camera is absent, is held by another
  /// process (which is named), or refuses.
  virtual Status start() = 0;
  /// Stops filming within a bounded time and drops queued frames. No effect when not filming.
  virtual void stop() = 0;
  /// The next frame in order; waits at most `deadline`. An incomplete frame is either returned as damaged or
  /// counted and skipped. Errors: timed_out, device (camera lost), out_of_data (the end of a recording).
  virtual Result<Frame> next_frame(Seconds deadline) = 0;
  /// Drops the frames that arrived up to `until` and weren't fetched. They don't count as lost. Returns their
  /// number.
  virtual std::uint64_t pass_over(TimePoint until) = 0;
  /// Resets the shutter, which gives it a new phase. The reset starts at `at` (immediately if that has
  /// passed); the call may block until then. Frames queued before are dropped, so the next frame shows the
  /// new phase. Error `device` when the camera can't be reset (ShutterReset::none).
  virtual Status reset_shutter(TimePoint at) = 0;
  /// Changes the frame rate to `trim` above the camera's own, untrimmed rate. It takes effect soon, loses no
  /// frame and persists over shutter resets. `trim` is rounded to a step. Error `device` when the camera
  /// can't trim, or not that far.
  virtual Status trim_rate(PartsPerMillion trim) = 0;
};

}  // namespace emberlock::drivers
