// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

class CameraWriter;
class EventLog;

/// How pixels are stored in the segments. All encodings are lossless; `transcode` converts the others to ffv1
/// later.
enum class Encoding {
  ffv1,         ///< FFV1 version 3 with slice CRCs in Matroska
  raw_nut,      ///< uncompressed in NUT, where the encoder would be too slow
  huffman_nut,  ///< in NUT: 8-bit RGB as Ut Video, 8-bit grey and Bayer as FFVHUFF, six times as fast as FFV1
                ///< and a sixth larger; wider samples uncompressed
};

struct WriterOptions {
  Encoding encoding = Encoding::ffv1;
  std::uint64_t frames_per_segment = 3000;                   ///< >= 1
  std::uint64_t bytes_per_segment = std::uint64_t{1} << 30;  ///< a segment that reaches this size is closed
  std::uint64_t min_free_bytes = std::uint64_t{1} << 30;  ///< below this much free space frames are refused
};

/// Why a frame that the camera produced isn't in the recording.
enum class LossCause {
  transport,    ///< the bus or network lost it
  underrun,     ///< the driver had no free buffer
  queue,        ///< the encoder was too slow: the recorder's queue was full
  disk,         ///< no space, or the disk refused the write
  passed_over,  ///< skipped in the driver on purpose, because no one needed it: not lost
};

/// The frames that arrived from a camera, by their ids.
class Arrivals {
 public:
  void add(std::uint64_t frame_id) {
    if (delivered_++ > 0 && frame_id > last_id_) missing_ += frame_id - last_id_ - 1;
    last_id_ = frame_id;
  }
  [[nodiscard]] std::uint64_t delivered() const { return delivered_; }
  [[nodiscard]] std::uint64_t missing() const {
    return missing_;
  }  ///< skipped ids; 0 when the camera restarts its count

 private:
  std::uint64_t delivered_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t last_id_ = 0;
};

/// The disk refuses what is written. It is over once later frames are on the disk, and nothing was refused
/// for two seconds.
struct DiskTrouble {
  Error error;            ///< of the newest refusal
  Seconds lasting{0};     ///< from the first refusal to the newest
  bool is_final = false;  ///< nothing is tried again
};

/// Progress of one camera's recording: arrived = queued + written + lost by queue and disk.
struct CameraProgress {
  std::uint64_t arrived = 0;  ///< frames passed to push()
  std::uint64_t queued = 0;   ///< in memory: waiting or in the encoder. Lost if the recorder is killed
  std::uint64_t written = 0;  ///< handed to the operating system. May be lost in a power cut
  std::uint64_t safe = 0;     ///< synced to the disk; included in `written`
  Seconds at_risk{0};         ///< age of the oldest frame that isn't safe yet
  double queue_fill = 0;      ///< 0..1, by bytes or by time, whichever is larger
  std::uint64_t bytes = 0;    ///< handed to the operating system: segments and index
  /// The counts that finish() would report now, with recorded = safe. Queued frames are in none of them.
  v1::Counts counts;
  std::optional<DiskTrouble> trouble = {};
};

/// Writes a session's folder. Everything recorded is on the disk after finish(); before that, what flush()
/// and sync() have put there (AsyncWriter calls them continuously). Different cameras may be written from
/// different threads at the same time; one camera, and append(), by one thread at a time. If destroyed
/// without finish(), it leaves the same as a killed recorder: a session in state RECORDING, for `salvage`.
class SessionWriter {
 public:
  /// Creates the folder (it must be missing or empty) with its manifest. In `manifest` the caller sets
  /// purpose and box, may set `created_utc` and `session_id`, and sets for each camera id, model, layout,
  /// rate, reset and calibration; the rest is set here. Errors: bad_input (unusable camera id or layout;
  /// names the field), io.
  static Result<SessionWriter> create(const std::filesystem::path& folder, v1::Manifest manifest,
                                      WriterOptions options = {});
  SessionWriter(SessionWriter&&) noexcept;
  SessionWriter& operator=(SessionWriter&&) noexcept;
  ~SessionWriter();

  [[nodiscard]] std::size_t camera_count() const { return cameras_.size(); }

  /// Appends a frame of camera `camera` (its index in the manifest). Frame ids rise; a smaller id means that
  /// the camera restarted its count. Errors: bad_input (layout differs from the manifest's), io. A frame that
  /// isn't written counts as lost to the disk, and so do earlier frames that a failed write turns out to have
  /// destroyed. Writing is tried again once a second, in a new segment, so a later frame may succeed.
  Status write(std::size_t camera, const Frame& frame);
  /// Counts frames that will never be written. For `transport`, `underrun` and `passed_over`, `frames` of the
  /// ids that never arrived were lost or skipped on the way, not by the camera. For `queue` and `disk` they
  /// arrived and were dropped.
  void count_lost(std::size_t camera, LossCause cause, std::uint64_t frames);
  /// Hands what was written to the operating system. This also happens automatically after at most a quarter
  /// of a second of frames. Called by the camera's thread. Errors as write(): lost frames are counted.
  Status flush(std::size_t camera);
  /// Syncs the flushed frames of all cameras, and the events, to the disk. Any thread, concurrently with all
  /// other calls, which don't wait for it. A failure is also reported by the cameras' next write; frames that
  /// aren't safe then count as lost to the disk.
  Status sync();
  /// What the newest sync() found of the events, which a later one writes again. Any thread.
  [[nodiscard]] Status events_failure() const;
  /// Number of frames that would survive a power cut. Any thread.
  [[nodiscard]] std::uint64_t safe(std::size_t camera) const;
  /// What was written, and what the disk refused; without the caller's queue. Called by the camera's thread.
  [[nodiscard]] CameraProgress progress(std::size_t camera) const;
  /// For callers that queue frames before write(): the arrivals at that queue, which replace those that
  /// write() saw.
  void set_arrivals(std::size_t camera, const Arrivals& arrivals);
  /// At any time, in chronological order.
  Status append(const v1::Event& event);

  /// Closes everything, reconciles the counts with the disk and sets the manifest's state to COMPLETE. Space
  /// for that manifest was reserved: on a full disk all stored frames are kept, and refused ones counted.
  /// After an Error (the disk fails, or the counts don't add up) the session stays RECORDING.
  Result<v1::Manifest> finish(const Progress& progress = {});

 private:
  SessionWriter(std::filesystem::path folder, v1::Manifest manifest);
  std::filesystem::path folder_;
  v1::Manifest manifest_;
  std::vector<std::unique_ptr<CameraWriter>> cameras_;
  std::unique_ptr<EventLog> events_;
};

}  // namespace emberlock::session
