// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "drivers/camera.h"
#include "drivers/virtual/crystal.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/sensor.h"
#include "drivers/virtual/shared_light.h"
#include "drivers/virtual/strobe_timeline.h"

namespace emberlock::drivers {

/// State shared by all cameras of a rig. Thread-safe.
class VirtualRoom {
 public:
  VirtualRoom(std::shared_ptr<Clock> clock, const VirtualRigOptions& rig);

  [[nodiscard]] Clock& clock() const { return *clock_; }
  [[nodiscard]] const std::shared_ptr<StrobeTimeline>& strobe() const { return strobe_; }
  [[nodiscard]] TimePoint opened() const { return opened_; }
  /// What StrobeTimeline::light says, after a look at what another process may have set.
  [[nodiscard]] std::vector<LightPulse> light(TimePoint origin, Seconds from, Seconds to) const;
  void set_scene(VirtualScene scene);
  /// The scene shown by a frame whose read phase begins at t.
  [[nodiscard]] std::shared_ptr<const VirtualScene> scene_at(TimePoint t) const;

 private:
  struct Change {
    TimePoint at;
    std::shared_ptr<const VirtualScene> scene;
  };
  std::shared_ptr<Clock> clock_;
  std::shared_ptr<StrobeTimeline> strobe_;
  std::unique_ptr<LightFollower> follower_;  // of another process's strobe
  TimePoint opened_;
  mutable std::mutex mutex_;
  std::vector<Change> scenes_;  // in order of time, never empty
};

/// One camera with any kind of sensor. Frames are numbered from 0 at the first start(), continuing through
/// stops and resets, and drawn when they are fetched.
class VirtualCamera final : public Camera {
 public:
  VirtualCamera(VirtualCameraOptions options, int number, const VirtualRigOptions& rig,
                std::shared_ptr<const VirtualRoom> room);

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override { filming_ = false; }
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

  void set_reset(ShutterReset reset) { info_.reset = reset; }
  [[nodiscard]] const VirtualCameraOptions& truth() const { return options_; }
  [[nodiscard]] TimePoint read_start(std::uint64_t frame_id) const;
  [[nodiscard]] TimePoint read_start_after(TimePoint after) const;
  [[nodiscard]] const Crystal& crystal() const { return crystal_; }
  [[nodiscard]] std::vector<LightPulse> light_on(std::uint64_t frame_id) const;
  [[nodiscard]] std::shared_ptr<const VirtualScene> scene_of(std::uint64_t frame_id) const;

 private:
  /// Read phases start at `start` + i `period`, by the camera's crystal; that of i >= 1 delivers frame
  /// first_id + i - 1. The image of i = 0 is dropped after a reset; after a trim it is the last image of the
  /// previous cycle.
  struct Cycle {
    TimePoint start;
    std::uint64_t first_id = 0;
    Seconds period;
  };

  [[nodiscard]] TimePoint read_end(std::uint64_t frame_id) const;
  /// The first frame whose last row hasn't been read by `t`.
  [[nodiscard]] std::uint64_t read_by(TimePoint t) const;
  /// The time that the camera's crystal counts between two instants.
  [[nodiscard]] Seconds counted(TimePoint from, TimePoint to) const;
  /// The start of read phase i.
  [[nodiscard]] TimePoint read_start(const Cycle& cycle, double i) const;
  [[nodiscard]] TimePoint read_start(const Cycle& cycle, std::uint64_t frame_id) const {
    return read_start(cycle, static_cast<double>(frame_id - cycle.first_id + 1));
  }
  [[nodiscard]] Seconds shifting() const { return Rows(options_.timing.shifts) * options_.timing.row_time; }
  void begin_cycle(TimePoint start, std::uint64_t first_id);
  void drop_overflow();
  [[nodiscard]] Frame draw(std::uint64_t frame_id);
  [[nodiscard]] Seconds exposure(const VirtualScene& scene) const;

  VirtualCameraOptions options_;
  std::shared_ptr<const VirtualRoom> room_;
  CameraInfo info_;
  VirtualSensor sensor_;
  std::uint64_t seed_;  // for phases and latencies
  Crystal crystal_;
  std::uint64_t draws_ = 0;
  std::uint64_t queue_frames_;
  TimePoint wall_at_zero_;
  Seconds device_origin_;  // of the camera's own clock
  std::vector<Cycle> cycles_;
  std::uint64_t next_id_ = 0;
  Seconds period_;  ///< with the trim applied
  bool filming_ = false;
  FrameCounts counts_;
};

}  // namespace emberlock::drivers
