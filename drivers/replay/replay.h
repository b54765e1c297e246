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

// A recorded session behind the interfaces of live devices, so that the code that ran live runs again on the
// same frames.
//
// Calls that must come in the order of the recording:
// - for each camera, frames, resets and trims: next_frame returns the recorded frames one after another, and
//   the n-th reset_shutter or trim_rate corresponds to the camera's n-th event. Frames that the live run
//   never fetched aren't in the recording, so a reset skips none.
// - for the strobe, read_back: the n-th call returns the n-th StrobeState.
// - for the clock: none, provided that the live run read it only for the instants stored in events, once
//   each, when the event before was complete (a reset's before the call, a strobe state's after read_back).
//   See ReplayClock.
// The order of calls between devices is free. A call that isn't in the recording is an Error of kind device:
// the run has diverged from the recording.
namespace emberlock::drivers {

/// Returns the instants that the live run read for its events, bit for bit: directly after a read_back, that
/// of its strobe state; otherwise that of the next strobe state, reset or trim; after the last event, the
/// latest instant replayed. Sleeping returns at once and advances the time. Thread-safe.
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
  std::vector<bool> done_;           ///< replayed, or not an event of a device
  std::size_t next_ = 0;             ///< the first event that isn't done
  TimePoint latest_;
  std::optional<TimePoint> own_;
};

/// One camera of a session. A recorded frame is available at once. A frame that timed out in the live run
/// times out again after the same sum of deadlines. A frame that can't be read (damaged file) is an Error of
/// kind bad_input that names file and frame; the next call continues behind it.
class ReplayCamera final : public Camera {
 public:
  ReplayCamera(std::shared_ptr<session::SessionReader> session, std::size_t camera,
               std::shared_ptr<ReplayClock> clock);
  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  /// Counts of the replay; the losses of the live run are in the session's manifest.
  [[nodiscard]] FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override { filming_ = false; }
  Result<Frame> next_frame(Seconds deadline) override;
  /// Always 0: frames that the live run dropped aren't in the recording.
  std::uint64_t pass_over(TimePoint /*until*/) override { return 0; }
  /// Error device also if the recorded reset was requested for another instant.
  Status reset_shutter(TimePoint at) override;
  /// Error device also if the recorded trim had another value.
  Status trim_rate(PartsPerMillion trim) override;

 private:
  /// The index of the camera's next reset or trim event, from next_event_ on; nullopt if there is none.
  [[nodiscard]] std::optional<std::size_t> next_order() const;
  /// Whether the next frame timed out in the live run, and still does.
  [[nodiscard]] bool late(Seconds deadline);

  std::shared_ptr<session::SessionReader> session_;
  std::size_t camera_;
  std::shared_ptr<ReplayClock> clock_;
  CameraInfo info_;
  FrameCounts counts_;
  bool filming_ = false;
  std::size_t next_frame_ = 0;
  std::size_t next_event_ = 0;
  std::deque<LateFrame> late_;  ///< still to come
  Seconds waited_;              ///< so far, for the first of them
};

/// The strobe of a session.
class ReplayStrobe final : public Strobe {
 public:
  ReplayStrobe(std::shared_ptr<const session::SessionReader> session, std::shared_ptr<ReplayClock> clock);
  [[nodiscard]] const std::string& id() const override { return id_; }
  /// Accepts settings that fit the next StrobeState; error device where its output differs.
  Status apply(const StrobeSettings& settings) override;
  Result<StrobeSettings> read_back() override;

 private:
  /// The index of the next StrobeState event.
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
