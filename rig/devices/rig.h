// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "base/frame.h"
#include "base/result.h"
#include "drivers/camera_thread.h"
#include "drivers/replay/replay.h"
#include "drivers/virtual/virtual_rig.h"
#include "rig/align/run.h"
#include "rig/config/config.h"
#include "rig/devices/device_list.h"
#include "rig/devices/paced_replay.h"
#include "rig/devices/shown_camera.h"

namespace emberlock::rig {

struct RigOptions {
  std::size_t queue_frames = 64;  ///< of each camera that has a thread
  /// Shown every frame as it comes, also those that nobody takes: on the camera's own thread in a rig in real
  /// time, so it must be thread-safe, and return at once.
  std::function<void(std::size_t camera, const Frame&)> on_frame = {};
  std::span<const drivers::CameraDriver> drivers = camera_drivers();
};

/// The configured cameras and strobe, opened. In real time every camera has a thread of its own
/// (drivers/camera_thread.h); one that isn't there is lost, and looked for. A rig whose cameras are all
/// virtual and fast, or all recorded, strobe included, runs on its own clock and on its owner's thread alone,
/// the same each time. Cameras keep the order of the configuration. One owner thread, but for state(),
/// trouble() and counts().
class Rig {
 public:
  enum class Pace {
    real_time,
    fast,      ///< virtual, as fast as pictures are drawn
    recorded,  ///< a session, as fast as its frames are read; the clock gives its instants
  };

  /// Opens nothing that takes time: cameras and strobe are looked for when they are started. Errors:
  /// bad_input (what doesn't fit together; a session that can't be read).
  static Result<std::unique_ptr<Rig>> open(const RigConfig& config, RigOptions options = {});
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  [[nodiscard]] Pace pace() const { return pace_; }
  [[nodiscard]] std::size_t size() const { return cameras_.size(); }
  [[nodiscard]] drivers::Camera& camera(std::size_t index) { return *cameras_.at(index).camera; }
  /// "virtual", "v4l2", ...
  [[nodiscard]] std::string_view driver(std::size_t index) const { return cameras_.at(index).driver; }
  /// Null where the rig has none.
  [[nodiscard]] drivers::Strobe* strobe() { return strobe_; }
  [[nodiscard]] Clock& clock() { return *clock_; }
  /// All of it, for an alignment; without a recorder.
  [[nodiscard]] AlignRig devices();

  [[nodiscard]] drivers::CameraThread::State state(std::size_t index) const;
  /// Why a camera is lost or quarantined.
  [[nodiscard]] std::optional<Error> trouble(std::size_t index) const;
  [[nodiscard]] drivers::FrameCounts counts(std::size_t index) const {
    return cameras_.at(index).camera->counts();
  }

  /// What is known of how each camera is read, from the configuration and, where that is silent, from its
  /// picture.
  [[nodiscard]] std::vector<smear::CcdTiming> timing() const;
  /// The options of an alignment of this rig: with its timings, the reference by its id, and the delays that
  /// were learnt. Errors: bad_input (no such camera; a file of delays that can't be read).
  [[nodiscard]] Result<AlignRunOptions> align_options(const AlignmentConfig& config);

  /// Of virtual cameras whose scene has a flame: it burns from now on, in a dark room, or the strobe's room
  /// is there again. Of others nothing.
  enum class Scene { strobe, flame };
  Status show(Scene scene);
  /// The virtual cameras' truth; null without virtual cameras.
  [[nodiscard]] drivers::VirtualRig* virtual_rig() { return virtual_.get(); }

 private:
  struct Member {
    std::unique_ptr<drivers::Camera> camera;
    std::string_view driver;
    CameraConfig config;
    drivers::CameraThread* thread = nullptr;  ///< what `camera` is in real time
    ShownCamera* shown = nullptr;             ///< what it is otherwise
  };
  explicit Rig(RigOptions options) : options_(std::move(options)) {}
  Status open_virtual(const RigConfig& config);
  Status open_replay(const RigConfig& config);
  Status open_strobe(const RigConfig& config);
  Status add_real(const CameraConfig& config, Hertz rate);
  Status add_recorded(const CameraConfig& config);
  void add(std::unique_ptr<drivers::Camera> camera, std::string_view driver, const CameraConfig& config);
  void add_borrowed(drivers::Camera& camera, std::string_view driver, const CameraConfig& config);

  RigOptions options_;
  Pace pace_ = Pace::real_time;
  std::shared_ptr<Clock> clock_;
  std::unique_ptr<drivers::VirtualRig> virtual_;
  drivers::VirtualScene room_;                        ///< of virtual cameras
  std::shared_ptr<const drivers::LightField> flame_;  ///< null where none burns
  std::optional<drivers::ReplayRig> replay_;
  std::shared_ptr<ReplayPace> replay_pace_;
  std::unique_ptr<drivers::Strobe> own_strobe_;
  drivers::Strobe* strobe_ = nullptr;
  std::vector<Member> cameras_;  ///< gone before what they use
};

}  // namespace emberlock::rig
