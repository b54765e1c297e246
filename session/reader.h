// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

class CameraReader;

/// Reads the folder of a finished session, or follows one that is being recorded. Different cameras may be
/// read by different threads at the same time; one camera by one thread at a time.
class SessionReader {
 public:
  /// Errors: bad_input (no session; damaged manifest, index or events; not finished: run `salvage` first),
  /// io.
  static Result<SessionReader> open(const std::filesystem::path& folder);
  /// A session that is being recorded, of which no frame is known yet: advance() tells. Its events aren't
  /// read. Only reads, and takes no lock: the recorder doesn't notice. Errors: bad_input (no session; damaged
  /// manifest), io.
  static Result<SessionReader> follow(const std::filesystem::path& folder);
  /// Of follow(): so many frames of each camera are recorded, which is what its writer calls safe
  /// (CameraProgress): those on the disk. No others are looked at. Counts that fall change nothing. Errors:
  /// bad_input (another number of cameras; an index that has fewer frames, or a damaged one), io.
  Status advance(const std::vector<std::uint64_t>& safe);
  SessionReader(SessionReader&&) noexcept;
  SessionReader& operator=(SessionReader&&) noexcept;
  ~SessionReader();

  /// Whether `folder` holds a session (a manifest), finished or not.
  static bool is_session(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const v1::Manifest& manifest() const { return manifest_; }
  [[nodiscard]] std::size_t camera_count() const { return cameras_.size(); }
  [[nodiscard]] const ImageLayout& layout(std::size_t camera) const;
  /// One stamp per recorded frame, in the order of recording. Their monotonic_time, like that of the frames
  /// that read() returns, is on the session's clock: of a session that was joined from several hosts' parts
  /// the files have it on the clock of the host that recorded them.
  [[nodiscard]] const std::vector<FrameStamp>& stamps(std::size_t camera) const;
  /// In the order of recording.
  [[nodiscard]] const std::vector<v1::Event>& events() const { return events_; }

  /// Frame `i` of stamps(camera). Any order works; ascending order is fastest. The pixels are exactly those
  /// recorded: a missing segment, or pixels that don't match their hash, are an Error (bad_input) that names
  /// file and frame; other frames stay readable. Past the end, or what is known of a session that is
  /// followed: out_of_data. Different cameras can be read from different threads.
  Result<Frame> read(std::size_t camera, std::size_t i);

 private:
  SessionReader(std::filesystem::path folder, v1::Manifest manifest);
  std::filesystem::path folder_;
  v1::Manifest manifest_;
  bool grows_ = false;
  std::vector<v1::Event> events_;
  std::vector<std::unique_ptr<CameraReader>> cameras_;
};

}  // namespace emberlock::session
