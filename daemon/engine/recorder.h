// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "daemon/live/yield.h"
#include "drivers/camera.h"
#include "emberlock/v1/status.pb.h"
#include "session/async_writer.h"

namespace emberlock::daemon {

/// What driver and recorder say of one camera's frames in one recording.
struct CameraBooks {
  drivers::FrameCounts driver;  ///< from its begin to its end
  std::uint64_t left_out = 0;   ///< delivered in that time, but filmed before it began or after it ended
  session::Arrivals arrivals;   ///< what was handed to the recorder
  std::uint64_t dropped = 0;    ///< of it, for want of room in the queue
};

/// Of the frame numbers that are missing among the arrivals those that the driver has an explanation for:
/// `transport`, `underrun` and `passed_over`. What it lost before the first arrival or after the last is none
/// of the recording's.
v1::Counts explain(const CameraBooks& books);

/// Why driver, queue and file don't agree on a camera's frames, in a sentence; empty if they do.
std::string disagreement(const CameraBooks& books, const v1::Counts& file);

/// Of the frames that a camera made those that a recording hasn't, whatever the cause; what nobody wanted
/// isn't lost.
std::uint64_t lost(const v1::Counts& counts);

struct RecorderOptions {
  session::WriterOptions writer;
  session::AsyncWriterOptions queue;
};

/// What of a recording is on the disk by now, and whether it has trouble.
struct RecordedNow {
  std::vector<std::uint64_t> safe;  ///< frames, by camera
  RecordingLoad load;               ///< without what only the devices know
};

/// One recording in progress: frames in, a session's folder out, and the books on what became of each. Each
/// camera's frames come on one thread at a time, and end before finish(); any thread may ask.
class Recorder {
 public:
  /// Of `manifest` the caller fills what SessionWriter::create says. `before` is what the drivers count now,
  /// by camera. Error io, and no folder is left: below the floor of free space, or it can't be written.
  static Result<std::unique_ptr<Recorder>> begin(const std::filesystem::path& folder,
                                                 const v1::Manifest& manifest, const RecorderOptions& options,
                                                 const std::vector<drivers::FrameCounts>& before,
                                                 TimePoint now);

  /// Waits only where the options say so. Frames that came before it began or after it ended are left out.
  void take(std::size_t camera, const Frame& frame);
  /// It holds what was filmed until then; frames of that time may still be on their way.
  void end(TimePoint at);
  /// Whether a frame has come that this camera filmed after the end.
  [[nodiscard]] bool has_all(std::size_t camera) const;
  /// When the newest frame of any camera was filmed; nothing before the first.
  [[nodiscard]] std::optional<TimePoint> newest_frame() const;
  Status append(const v1::Event& event) { return writer_.append(event); }
  /// What the disk refuses now; writing is tried again.
  [[nodiscard]] std::optional<session::DiskTrouble> trouble() const { return writer_.trouble(); }
  [[nodiscard]] v1::RecordingStatus status(TimePoint now) const;
  [[nodiscard]] session::WriterLoad load() const { return writer_.load(); }
  [[nodiscard]] RecordedNow now() const;
  /// Frames for which its queues had no room.
  [[nodiscard]] std::uint64_t no_room() const;

  /// Drains the queues, closes the session and compares the books. The last that changes anything. Another
  /// thread may ask for the status meanwhile.
  v1::RecordingStatus finish(const std::vector<drivers::FrameCounts>& after, TimePoint now,
                             const Progress& progress = {});

 private:
  Recorder(session::SessionWriter writer, const RecorderOptions& options, std::string session,
           std::string purpose, const std::vector<drivers::FrameCounts>& before, TimePoint now);
  void show_progress(v1::RecordingStatus& status) const;

  session::AsyncWriter writer_;
  std::string session_;
  std::string purpose_;
  TimePoint began_;
  const std::vector<drivers::FrameCounts> before_;  ///< by camera, what the driver had counted when it began
  mutable std::mutex mutex_;                        ///< of all below
  std::optional<TimePoint> ended_;
  std::optional<TimePoint> newest_;
  std::vector<bool> past_end_;  ///< by camera
  std::vector<CameraBooks> books_;
};

}  // namespace emberlock::daemon
