// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/frame.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/sensor_kind.h"
#include "base/shutter.h"

namespace emberlock::drivers {

/// What a frame's device_time marks.
enum class DeviceTimeOf { unknown, exposure_start, frame_end };

struct CameraInfo {
  /// Stable identity: serial number, else USB path or MAC; never an index. Fit for a folder's name (letters,
  /// digits, space and . _ : -).
  std::string id;
  std::string model;
  ImageLayout layout;
  Hertz frame_rate;  ///< nominal
  ShutterReset reset = ShutterReset::none;
  std::optional<FrameRateTrim> trim = {};  ///< absent: it films at its own rate alone
  SensorKind sensor = SensorKind::ccd;
  DeviceTimeOf device_time_of = DeviceTimeOf::unknown;
  Seconds transport{0};  ///< at most, from a frame's last row to its arrival: what camera and bus hold back
};

/// What became of the frames that a camera made since it was opened. Each is in exactly one of these; a new
/// count after start() or a reset adds none.
struct FrameCounts {
  std::uint64_t delivered = 0;    ///< handed on whole
  std::uint64_t damaged = 0;      ///< handed on with FrameStatus::damaged
  std::uint64_t camera_gap = 0;   ///< numbers skipped that nothing else explains
  std::uint64_t transport = 0;    ///< the bus or network lost it, or a part of it
  std::uint64_t resend = 0;       ///< parts were asked for again and never came
  std::uint64_t underrun = 0;     ///< the driver had no buffer for it
  std::uint64_t queue = 0;        ///< nobody took it in time: the queue was full
  std::uint64_t passed_over = 0;  ///< dropped by stop(), pass_over() or a reset, as nobody wanted it

  [[nodiscard]] std::uint64_t lost() const { return camera_gap + transport + resend + underrun + queue; }
  [[nodiscard]] std::uint64_t made() const { return delivered + damaged + passed_over + lost(); }
  friend bool operator==(const FrameCounts&, const FrameCounts&) = default;
};

/// The longest that a call without a deadline of its own may take.
inline constexpr Seconds kCallDeadline{2};

/// A camera, opened. One owner thread; not thread-safe. Times are on the host's clock given to the driver.
///
/// A camera that goes away (unplugged, control lost) says so once, as error `device` of next_frame, and no
/// longer films; start() then looks for it by its id, and sets it up as it was: error `device` again until it
/// is back. The object stays valid meanwhile. No call takes longer than its deadline, or kCallDeadline.
class Camera {
 public:
  virtual ~Camera() = default;
  [[nodiscard]] virtual const CameraInfo& info() const = 0;
  [[nodiscard]] virtual FrameCounts counts() const = 0;

  /// Begins to film; frames queue from here on. Error `device`: it isn't there, is held by another process
  /// (which is named), or refuses.
  virtual Status start() = 0;
  /// Ends filming within a bounded time and drops queued frames. Harmless when not filming.
  virtual void stop() = 0;
  /// The next frame in order, waiting at most `deadline`. A frame that didn't come whole is either handed on
  /// as damaged or counted and left out. Errors: timed_out, device (camera lost), out_of_data (a recording
  /// has ended).
  virtual Result<Frame> next_frame(Seconds deadline) = 0;
  /// Drops the frames that came until `until` and weren't taken, as nobody wants them: they aren't lost.
  /// Returns how many.
  virtual std::uint64_t pass_over(TimePoint until) = 0;
  /// Draws the shutter phase anew, the action starting at `at` (at once if that has passed); may wait until
  /// then. Frames queued before it are dropped: the next frame shows the new phase. Error `device` when the
  /// camera can't (ShutterReset::none).
  virtual Status reset_shutter(TimePoint at) = 0;
  /// Films faster than its own rate by `trim` from soon on, resets of the shutter notwithstanding; no frame
  /// is lost. What is asked for is rounded to a step. Error `device` when the camera can't, or not so far.
  virtual Status trim_rate(PartsPerMillion trim) = 0;
};

}  // namespace emberlock::drivers
