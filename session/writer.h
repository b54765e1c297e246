// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

class CameraWriter;
class EventLog;

/// How pixels lie in the segments. All are lossless; `transcode` turns the others into ffv1 later.
enum class Encoding {
  ffv1,         ///< FFV1 version 3 with slice CRCs in Matroska
  raw_nut,      ///< uncompressed in NUT, where the encoder can't keep up
  huffman_nut,  ///< in NUT: RGB of 8 bits as Ut Video, grey and Bayer of 8 as FFVHUFF, six times as fast as
                ///< FFV1 and a sixth larger; wider samples uncompressed
};

struct WriterOptions {
  Encoding encoding = Encoding::ffv1;
  std::uint64_t frames_per_segment = 3000;                   ///< >= 1
  std::uint64_t bytes_per_segment = std::uint64_t{1} << 30;  ///< a segment that has grown to this is closed
  std::uint64_t min_free_bytes = std::uint64_t{1} << 30;  ///< below this much free space frames are refused
};

/// Why a frame that the camera made isn't in the recording.
enum class LossCause {
  transport,    ///< the bus or network lost it
  underrun,     ///< the driver had no buffer for it
  queue,        ///< the encoder was too slow: the recorder's queue was full
  disk,         ///< no space, or the disk refused
  passed_over,  ///< it was left with the driver on purpose, as nobody wanted it: not lost
};

/// The frames that a camera delivered, by their ids.
class Arrivals {
 public:
  void add(std::uint64_t frame_id) {
    if (delivered_++ > 0 && frame_id > last_id_) missing_ += frame_id - last_id_ - 1;
    last_id_ = frame_id;
  }
  [[nodiscard]] std::uint64_t delivered() const { return delivered_; }
  [[nodiscard]] std::uint64_t missing() const {
    return missing_;
  }  ///< ids skipped; none where the count starts anew

 private:
  std::uint64_t delivered_ = 0;
  std::uint64_t missing_ = 0;
  std::uint64_t last_id_ = 0;
};

struct WrittenSoFar {
  std::uint64_t frames = 0;   ///< with the operating system: a killed recorder doesn't take them along
  std::uint64_t refused = 0;  ///< frames, by the disk
  std::uint64_t bytes = 0;    ///< handed to the disk, of segments and index
};

/// Writes a session's folder. What is recorded is on the disk after finish(); before that what flush() and
/// sync() put there, which AsyncWriter calls all the time. Distinct cameras may be written from distinct
/// threads at the same time; one camera, and append(), by one thread at a time. Destroyed without finish() it
/// leaves what a killed recorder would leave: a session in state RECORDING, for `salvage`.
class SessionWriter {
 public:
  /// Creates the folder (it must not exist, or be empty) with its manifest. Of `manifest` the caller fills
  /// purpose, box and, of each camera, id, model, layout, rate, reset and calibration; the rest is set here.
  /// `created_utc` and `session_id` stay the caller's. Errors: bad_input (camera id or layout unusable; names
  /// the field), io.
  static Result<SessionWriter> create(const std::filesystem::path& folder, v1::Manifest manifest,
                                      WriterOptions options = {});
  SessionWriter(SessionWriter&&) noexcept;
  SessionWriter& operator=(SessionWriter&&) noexcept;
  ~SessionWriter();

  [[nodiscard]] std::size_t camera_count() const { return cameras_.size(); }

  /// Appends a frame of camera `camera` (its place in the manifest). Frame ids rise; one that doesn't says
  /// that the camera counts anew. Errors: bad_input (other layout than the manifest's), io. A frame not
  /// written counts as lost to the disk, as do those before it that a failed write turns out to have cost. A
  /// later frame may succeed, in a new segment: it is tried once a second.
  Status write(std::size_t camera, const Frame& frame);
  /// Counts frames that will never be written. For `transport`, `underrun` and `passed_over`, `frames` of the
  /// ids that never arrived were lost or left by the driver rather than lost by the camera; for `queue` and
  /// `disk` they arrived and were dropped.
  void count_lost(std::size_t camera, LossCause cause, std::uint64_t frames);
  /// Hands what was written to the operating system; at the latest a quarter of a second of frames does that
  /// by itself. Asked by the camera's thread. Errors as write(): what it cost is counted.
  Status flush(std::size_t camera);
  /// Has the disk hold what was flushed of all cameras, and the events. Any thread, beside all others: they
  /// don't wait for it. An error is met by the cameras' next write too: frames that aren't safe then count as
  /// lost to the disk.
  Status sync();
  /// Frames that a power cut can't take any more. Any thread.
  [[nodiscard]] std::uint64_t safe(std::size_t camera) const;
  /// Asked by the camera's thread.
  [[nodiscard]] WrittenSoFar written(std::size_t camera) const;
  /// For whoever puts a queue before write(): what arrived before that queue, instead of what write() saw.
  void set_arrivals(std::size_t camera, const Arrivals& arrivals);
  /// Any time, in the order of happening.
  Status append(const v1::Event& event);

  /// Closes everything, reconciles the counts with what lies on disk and turns the manifest COMPLETE, for
  /// which room was kept: a disk that is full by now keeps what it has, and what it refused is counted. After
  /// an Error (the disk fails, or counts don't add up) the session stays RECORDING.
  Result<v1::Manifest> finish();

 private:
  SessionWriter(std::filesystem::path folder, v1::Manifest manifest);
  std::filesystem::path folder_;
  v1::Manifest manifest_;
  std::vector<std::unique_ptr<CameraWriter>> cameras_;
  std::unique_ptr<EventLog> events_;
};

}  // namespace emberlock::session
