// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <optional>

#include "base/clock.h"
#include "drivers/camera.h"
#include "session/reader.h"

namespace emberlock::rig {

/// Maps a recorded session's time to the live clock: the first frame is due when the first of the session's
/// cameras starts. Thread-safe.
class ReplayPace {
 public:
  ReplayPace(const session::SessionReader& session, std::shared_ptr<Clock> clock);
  void begin();
  [[nodiscard]] Clock& clock() const { return *clock_; }
  /// The due time of what was recorded at `recorded`; only after the start.
  [[nodiscard]] TimePoint due(TimePoint recorded) const;

 private:
  std::shared_ptr<Clock> clock_;
  TimePoint first_;
  mutable std::mutex mutex_;
  std::optional<TimePoint> began_;
};

/// A recorded camera beside live ones: its frames arrive at their recorded pace, with present times, and end
/// with out_of_data. No resets and no trims.
class PacedCamera final : public drivers::Camera {
 public:
  PacedCamera(std::shared_ptr<session::SessionReader> session, std::size_t camera,
              std::shared_ptr<ReplayPace> pace);

  [[nodiscard]] const drivers::CameraInfo& info() const override { return info_; }
  [[nodiscard]] drivers::FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override { filming_ = false; }
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

 private:
  [[nodiscard]] Error as_recorded() const;

  std::shared_ptr<session::SessionReader> session_;
  std::size_t camera_;
  std::shared_ptr<ReplayPace> pace_;
  drivers::CameraInfo info_;
  drivers::FrameCounts counts_;
  bool filming_ = false;
  std::size_t next_ = 0;
};

}  // namespace emberlock::rig
