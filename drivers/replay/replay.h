// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/replay/record.h"
#include "drivers/strobe.h"
#include "session/reader.h"

// A recorded session behind the interfaces of live devices, so that what ran live runs again on the same
// frames.
//
// What must be called in the order of the recording:
// - of each camera, frames, resets and trims: next_frame gives the recorded frames one after the other, and
//   the n-th reset_shutter or trim_rate meets the camera's n-th event. Frames that the live run never took
//   aren't in the recording, so a reset skips none.
// - of the strobe, read_back: the n-th meets the n-th StrobeState, and says what that says.
// - of the clock: nothing, if what the live run asked it were the instants that events carry, each asked once
// the
//   event before was done (a reset's before the call, a strobe state's after read_back). See ReplayClock.
// Between the devices the order is free. A call that the recording doesn't show is an Error of kind device:
// the replay has left the recorded course.
namespace emberlock::drivers {

/// Answers with the instants that the live run got for its events, bit for bit: directly after a read_back
/// that strobe state's own; otherwise that of the next strobe state, reset or trim to come; behind the last
/// one the latest instant replayed. Sleeping is passing the time at once. Thread-safe.
class ReplayClock final : public Clock {
 public:
  explicit ReplayClock(const session::SessionReader& session);
  [[nodiscard]] TimePoint now() const override;
  void sleep_until(TimePoint t) override;

 private:
  friend class ReplayCamera;
  friend class ReplayStrobe;
  enum class After { next_event, own_instant };
  void frame_replayed(TimePoint arrival);
  void event_replayed(std::size_t event, After after);

  mutable std::mutex mutex_;
  std::vector<TimePoint> instants_;  ///< of the session's events
  std::vector<bool> done_;           ///< replayed, or of no device
  std::size_t next_ = 0;             ///< the first event not done
  TimePoint latest_;
  std::optional<TimePoint> own_;
};

/// One camera of a session. A recorded frame is there at once; one that was waited for in vain is waited for
/// as long as then, by the sum of deadlines. A frame that the session can't give back (damaged file) is an
/// Error of kind bad_input that names file and frame; the call after goes on behind it.
class ReplayCamera final : public Camera {
 public:
  ReplayCamera(std::shared_ptr<session::SessionReader> session, std::size_t camera,
               std::shared_ptr<ReplayClock> clock);
  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  /// Of what was replayed; what the live run lost stands in the session's manifest.
  [[nodiscard]] FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override { filming_ = false; }
  Result<Frame> next_frame(Seconds deadline) override;
  /// None: what the live run passed over isn't in the recording.
  std::uint64_t pass_over(TimePoint /*until*/) override { return 0; }
  /// Error device also where the recorded reset was ordered for another instant.
  Status reset_shutter(TimePoint at) override;
  /// Error device also where the recorded trim was another one.
  Status trim_rate(PartsPerMillion trim) override;

 private:
  /// The camera's next reset or trim among the events, from next_event_ on; none where there is no other.
  [[nodiscard]] std::optional<std::size_t> next_order() const;
  /// Whether the next frame was waited for in vain, and still is.
  [[nodiscard]] bool late(Seconds deadline);

  std::shared_ptr<session::SessionReader> session_;
  std::size_t camera_;
  std::shared_ptr<ReplayClock> clock_;
  CameraInfo info_;
  FrameCounts counts_;
  bool filming_ = false;
  std::size_t next_frame_ = 0;
  std::size_t next_event_ = 0;
  std::deque<LateFrame> late_;  ///< to come
  Seconds waited_;              ///< for the first of them, so far
};

/// The session's strobe.
class ReplayStrobe final : public Strobe {
 public:
  ReplayStrobe(std::shared_ptr<const session::SessionReader> session, std::shared_ptr<ReplayClock> clock);
  [[nodiscard]] const std::string& id() const override { return id_; }
  /// Accepts what the next StrobeState can be the answer to: error device where its output is another one.
  Status apply(const StrobeSettings& settings) override;
  Result<StrobeSettings> read_back() override;

 private:
  /// Where the next StrobeState stands among the events.
  [[nodiscard]] Result<std::size_t> next_state() const;

  std::shared_ptr<const session::SessionReader> session_;
  std::shared_ptr<ReplayClock> clock_;
  std::string id_ = "replay";
  std::size_t next_event_ = 0;
};

/// All devices of a session on one clock, which starts at the first recorded instant.
struct ReplayRig {
  static Result<ReplayRig> open(const std::filesystem::path& folder);

  std::shared_ptr<session::SessionReader> session;
  std::shared_ptr<ReplayClock> clock;
  std::vector<std::unique_ptr<Camera>> cameras;  ///< in the manifest's order
  std::unique_ptr<Strobe> strobe;
};

}  // namespace emberlock::drivers
