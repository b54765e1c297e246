// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <future>
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
#include "rig/devices/observed_camera.h"
#include "rig/devices/paced_replay.h"
#include "rig/devices/shared_strobe.h"

namespace emberlock::rig {

struct RigOptions {
  std::size_t queue_frames = 64;  ///< of each camera with its own thread
  /// Called with every frame on arrival, also with frames that are never fetched. In a real-time rig it is
  /// called on the camera's own thread, so it must be thread-safe and return at once.
  std::function<void(std::size_t camera, const Frame&)> on_frame = {};
  std::span<const drivers::CameraDriver> drivers = camera_drivers();
  /// Opens a strobe of driver "serial".
  std::function<Result<std::unique_ptr<drivers::Strobe>>(const std::string& id,
                                                         const drivers::SerialStrobeRequest& request)>
      serial_strobe = drivers::open_serial_strobe;
  /// Opens a camera of driver "remote": the daemon's business. Absent: there are none.
  std::function<std::unique_ptr<drivers::Camera>(const CameraConfig& config, drivers::CameraInfo expected)>
      remote = {};
  /// The read-out timing of such a camera, as its host is told it; nothing before the host was reached.
  std::function<std::optional<smear::CcdTiming>(const CameraConfig& config)> remote_timing = {};
};

/// The configured cameras and strobe. In real time every camera has its own thread (drivers/camera_thread.h);
/// an absent camera counts as lost and is searched for. A rig whose cameras are all virtual and fast, or all
/// recorded with the strobe, runs on its own clock and on the owner's thread only, and is deterministic.
/// Cameras are in the order of the configuration, other hosts' behind this one's. One owner thread, except
/// for state(), trouble() and counts().
class Rig {
 public:
  enum class Pace {
    real_time,
    fast,      ///< virtual, as fast as pictures are drawn
    recorded,  ///< a session, as fast as its frames are read; the clock returns recorded instants
  };

  /// Doesn't wait for devices: cameras and strobe are searched for when they are started. Errors: bad_input
  /// (an inconsistent configuration; an unreadable session).
  static Result<std::unique_ptr<Rig>> open(const RigConfig& config, RigOptions options = {});
  Rig(const Rig&) = delete;
  Rig& operator=(const Rig&) = delete;

  [[nodiscard]] Pace pace() const { return pace_; }
  [[nodiscard]] std::size_t size() const { return cameras_.size(); }
  /// The first so many cameras are this host's, the others are other hosts'.
  [[nodiscard]] std::size_t own() const { return own_; }
  [[nodiscard]] drivers::Camera& camera(std::size_t index) { return *cameras_.at(index).camera; }
  /// "virtual", "v4l2", ...
  [[nodiscard]] std::string_view driver(std::size_t index) const { return cameras_.at(index).driver; }
  /// HOST:PORT of the host that has the camera; empty: this one.
  [[nodiscard]] const std::string& host(std::size_t index) const { return cameras_.at(index).config.host; }
  /// Null if the rig has none. Its calls may come from several threads.
  [[nodiscard]] drivers::Strobe* strobe() { return strobe_ ? &*strobe_ : nullptr; }
  /// Applies `wanted`, if given, and reads the settings back: in real time on a thread of its own, as a
  /// silent strobe takes seconds; otherwise when the result is asked for. The rig has a strobe.
  [[nodiscard]] std::future<Result<drivers::StrobeSettings>> ask_strobe(
      std::optional<drivers::StrobeSettings> wanted);
  [[nodiscard]] Clock& clock() { return *clock_; }
  /// All devices, for an alignment; without a recorder.
  [[nodiscard]] AlignRig devices();

  [[nodiscard]] drivers::CameraThread::State state(std::size_t index) const;
  /// Its thread takes longer than it may, but computes: the processor has too much to do.
  [[nodiscard]] bool overworked(std::size_t index) const {
    return cameras_.at(index).thread != nullptr && cameras_.at(index).thread->overworked();
  }
  /// Why a camera is lost or quarantined.
  [[nodiscard]] std::optional<Error> trouble(std::size_t index) const;
  [[nodiscard]] drivers::FrameCounts counts(std::size_t index) const {
    return cameras_.at(index).camera->counts();
  }

  /// Hands this camera's frames to `sink` from now on, until it is fed an empty one
  /// (drivers::CameraThread::feed): in real time on the camera's thread, else on the thread that waits for
  /// the next frame.
  drivers::FrameCounts feed(std::size_t index, drivers::FrameSink sink);

  /// Each camera's read-out timing from the configuration; for missing values, from its host's, else from its
  /// picture.
  [[nodiscard]] std::vector<smear::CcdTiming> timing() const;
  /// The options for aligning this rig: its timings, the reference by its id, and the learnt delays. Errors:
  /// bad_input (no such camera; an unreadable file of delays).
  [[nodiscard]] Result<AlignRunOptions> align_options(const AlignmentConfig& config);

  /// Switches the scene of virtual cameras that have a flame: a flame in a dark room, or the room of the
  /// strobe. No effect on others.
  enum class Scene {
    strobe,  ///< as the alignment wants it
    flame,   ///< and the strobe's flashes, if it flashes
  };
  Status show(Scene scene);
  /// The virtual cameras' true values; null without virtual cameras.
  [[nodiscard]] drivers::VirtualRig* virtual_rig() { return virtual_.get(); }

 private:
  struct Member {
    std::unique_ptr<drivers::Camera> camera;
    std::string_view driver;
    CameraConfig config;
    drivers::CameraThread* thread = nullptr;  ///< the type of `camera` in real time
    ObservedCamera* observed = nullptr;       ///< the type of `camera` otherwise
  };
  explicit Rig(RigOptions options) : options_(std::move(options)) {}
  Status open_virtual(const RigConfig& config);
  Status open_replay(const RigConfig& config);
  Status open_strobe(const RigConfig& config);
  Status add_real(const CameraConfig& config, Hertz rate);
  Status add_remote(const CameraConfig& config, Hertz rate);
  Status add_recorded(const CameraConfig& config);
  void add(std::unique_ptr<drivers::Camera> camera, std::string_view driver, const CameraConfig& config);
  /// Of a remote camera, a reset's order is on its way for a while.
  static constexpr Seconds kRemoteAhead = milliseconds(100);
  void add_borrowed(drivers::Camera& camera, std::string_view driver, const CameraConfig& config);

  RigOptions options_;
  Pace pace_ = Pace::real_time;
  std::shared_ptr<Clock> clock_;
  std::unique_ptr<drivers::VirtualRig> virtual_;
  drivers::VirtualScene room_;                        ///< scene of the virtual cameras
  std::shared_ptr<const drivers::LightField> flame_;  ///< null if there is none
  std::optional<drivers::ReplayRig> replay_;
  std::shared_ptr<ReplayPace> replay_pace_;
  std::unique_ptr<drivers::Strobe> own_strobe_;
  std::optional<SharedStrobe> strobe_;
  std::size_t own_ = 0;
  std::vector<Member> cameras_;  ///< last member: destroyed before what they use
};

}  // namespace emberlock::rig
