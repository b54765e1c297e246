#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "base/frame.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/sensor_kind.h"

namespace emberlock {

/// How a camera's shutter phase can be drawn anew.
enum class ShutterReset {
  none,
  by_hand,     ///< an operator presses a button; the phase that follows is uniform over the frame period
  on_command,  ///< the driver does it, a latency with some jitter after the moment asked for
};

/// How a camera's frame rate can be trimmed while it films.
struct FrameRateTrim {
  PartsPerMillion range;  ///< to either side of its own rate, > 0
  PartsPerMillion step;   ///< between two settings, > 0
  Seconds latency;        ///< from the order to the first frame at the new rate, on average, >= 0
};

struct CameraInfo {
  std::string id;  ///< stable identity: serial number, else USB path or MAC; never an index
  std::string model;
  ImageLayout layout;
  Hertz frame_rate;  ///< nominal
  ShutterReset reset = ShutterReset::none;
  std::optional<FrameRateTrim> trim = {};  ///< absent: it films at its own rate alone
  SensorKind sensor = SensorKind::ccd;
};

/// A camera, opened. One owner thread; not thread-safe. Times are on the host's clock given to the driver.
class Camera {
 public:
  virtual ~Camera() = default;
  [[nodiscard]] virtual const CameraInfo& info() const = 0;

  /// Begins to film; frames queue from here on.
  virtual Status start() = 0;
  /// Ends filming within a bounded time and drops queued frames. Harmless when not filming.
  virtual void stop() = 0;
  /// The next frame in order, waiting at most `deadline`. Errors: timed_out, device (camera lost),
  /// out_of_data (a recording has ended).
  virtual Result<Frame> next_frame(Seconds deadline) = 0;
  /// Drops the frames that came until `until` and weren't taken, as nobody wants them: they aren't lost.
  /// Returns how many.
  virtual std::uint64_t pass_over(TimePoint until) = 0;
  /// Draws the shutter phase anew, the action starting at `at` (at once if that has passed). Frames queued
  /// before it are dropped: the next frame shows the new phase. Error `device` when the camera can't
  /// (ShutterReset::none).
  virtual Status reset_shutter(TimePoint at) = 0;
  /// Films faster than its own rate by `trim` from soon on, resets of the shutter notwithstanding; no frame
  /// is lost. What is asked for is rounded to a step. Error `device` when the camera can't, or not so far.
  virtual Status trim_rate(PartsPerMillion trim) = 0;
};

}  // namespace emberlock
