#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/strobe.h"
#include "session/reader.h"

// A recorded session behind the interfaces of live devices, so that what ran live runs again on the same
// frames.
//
// What must be called in the order of the recording: for each camera its frames (next_frame gives the
// recorded frames one after the other) and its resets (the n-th reset_shutter of a camera meets its n-th
// ShutterResetEvent); for the strobe its settings (the n-th apply meets the n-th StrobeState). Between
// devices the order is free: nothing but the clock connects them. A call that the recording doesn't show is
// an Error of kind device: the replay has left the recorded course. Frames that the live run never took from
// a camera aren't in the recording, so a reset skips none.
namespace emberlock {

/// Shows the monotonic time of the latest frame or event that was replayed, and never goes back. Sleeping is
/// passing the time at once.
class ReplayClock final : public Clock {
 public:
  explicit ReplayClock(TimePoint start) : ns_(start.ns) {}
  [[nodiscard]] TimePoint now() const override { return {ns_.load()}; }
  void sleep_until(TimePoint t) override { advance_to(t); }
  void advance_to(TimePoint t);

 private:
  std::atomic<std::int64_t> ns_;
};

/// One camera of a session. Deadlines don't matter: a recorded frame is there at once. A frame that the
/// session can't give back (damaged file) is an Error of kind bad_input that names file and frame; the call
/// after goes on behind it.
class ReplayCamera final : public Camera {
 public:
  ReplayCamera(std::shared_ptr<SessionReader> session, std::size_t camera,
               std::shared_ptr<ReplayClock> clock);
  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  Status start() override;
  void stop() override { filming_ = false; }
  Result<Frame> next_frame(Seconds deadline) override;
  Status reset_shutter(TimePoint at) override;

 private:
  std::shared_ptr<SessionReader> session_;
  std::size_t camera_;
  std::shared_ptr<ReplayClock> clock_;
  CameraInfo info_;
  bool filming_ = false;
  std::size_t next_frame_ = 0;
  std::size_t next_event_ = 0;
};

/// The session's strobe: says what the recorded one said after each setting.
class ReplayStrobe final : public Strobe {
 public:
  ReplayStrobe(std::shared_ptr<const SessionReader> session, std::shared_ptr<ReplayClock> clock);
  [[nodiscard]] const std::string& id() const override { return id_; }
  /// Error device also where the recorded strobe was switched to another output (off, flashing, steady).
  Status apply(const StrobeSettings& settings) override;
  /// Error device before the first apply.
  Result<StrobeSettings> read_back() override;

 private:
  std::shared_ptr<const SessionReader> session_;
  std::shared_ptr<ReplayClock> clock_;
  std::string id_ = "replay";
  std::size_t next_event_ = 0;
  StrobeSettings state_;
  bool applied_ = false;
};

/// All devices of a session on one clock, which starts at the first recorded instant.
struct ReplayRig {
  static Result<ReplayRig> open(const std::filesystem::path& folder);

  std::shared_ptr<SessionReader> session;
  std::shared_ptr<ReplayClock> clock;
  std::vector<std::unique_ptr<Camera>> cameras;  ///< in the manifest's order
  std::unique_ptr<Strobe> strobe;
};

}  // namespace emberlock
