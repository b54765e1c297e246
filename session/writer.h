#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock {

class CameraWriter;
class EventLog;

/// How pixels lie in the segments. Both are lossless.
enum class Encoding {
  ffv1,     ///< FFV1 version 3 with slice CRCs in Matroska
  raw_nut,  ///< uncompressed in NUT, where the encoder can't keep up; `transcode` turns it into ffv1 later
};

struct WriterOptions {
  Encoding encoding = Encoding::ffv1;
  std::uint64_t frames_per_segment = 3000;                   ///< >= 1
  std::uint64_t bytes_per_segment = std::uint64_t{1} << 30;  ///< a segment that has grown to this is closed
  std::uint64_t min_free_bytes = std::uint64_t{1} << 30;  ///< below this much free space frames are refused
};

/// Why a frame that the camera made isn't in the recording.
enum class LossCause {
  transport,  ///< the bus or network lost it
  underrun,   ///< the driver had no buffer for it
  queue,      ///< the encoder was too slow: the recorder's queue was full
  disk,       ///< no space, or the disk refused
};

/// Writes a session's folder. Distinct cameras may be written from distinct threads at the same time; one
/// camera, and append(), by one thread at a time. Destroyed without finish() it leaves what a killed recorder
/// would leave: a session in state RECORDING, for `salvage`.
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

  /// Appends a frame of camera `camera` (its place in the manifest). Frame ids rise; one that falls says that
  /// the camera counts anew. Errors: bad_input (other layout than the manifest's), io (counted as lost to the
  /// disk).
  Status write(std::size_t camera, const Frame& frame);
  /// Counts a frame that will never be written, in its place in the order.
  void count_lost(std::size_t camera, std::uint64_t frame_id, LossCause cause);
  /// Of the ids that never arrived, `frames` were lost by the driver for `cause` rather than by the camera.
  void attribute_gap(std::size_t camera, std::uint64_t frames, LossCause cause);
  Status append(const v1::Event& event);

  /// Closes everything, reconciles the counts with what lies on disk and turns the manifest COMPLETE. After
  /// an Error (disk failure, or counts that don't add up) the session stays RECORDING.
  Result<v1::Manifest> finish();

 private:
  SessionWriter(std::filesystem::path folder, v1::Manifest manifest);
  std::filesystem::path folder_;
  v1::Manifest manifest_;
  std::vector<std::unique_ptr<CameraWriter>> cameras_;
  std::unique_ptr<EventLog> events_;
};

}  // namespace emberlock
