// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

class CameraReader;

/// Reads the folder of a finished session. Different cameras may be read by different threads at the same
/// time; one camera by one thread at a time.
class SessionReader {
 public:
  /// Errors: bad_input (no session; damaged manifest, index or events; not finished: run `salvage` first),
  /// io.
  static Result<SessionReader> open(const std::filesystem::path& folder);
  SessionReader(SessionReader&&) noexcept;
  SessionReader& operator=(SessionReader&&) noexcept;
  ~SessionReader();

  /// Whether `folder` holds a session (a manifest), finished or not.
  static bool is_session(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  [[nodiscard]] const v1::Manifest& manifest() const { return manifest_; }
  [[nodiscard]] std::size_t camera_count() const { return cameras_.size(); }
  [[nodiscard]] const ImageLayout& layout(std::size_t camera) const;
  /// One stamp per recorded frame, in the order of recording.
  [[nodiscard]] const std::vector<FrameStamp>& stamps(std::size_t camera) const;
  /// In the order of recording.
  [[nodiscard]] const std::vector<v1::Event>& events() const { return events_; }

  /// Frame `i` of stamps(camera). Any order works; ascending order is fastest. The pixels are exactly those
  /// recorded: a missing segment, or pixels that don't match their hash, are an Error (bad_input) that names
  /// file and frame; other frames stay readable. Past the end: out_of_data. Different cameras can be read
  /// from different threads.
  Result<Frame> read(std::size_t camera, std::size_t i);

 private:
  SessionReader(std::filesystem::path folder, v1::Manifest manifest);
  std::filesystem::path folder_;
  v1::Manifest manifest_;
  std::vector<v1::Event> events_;
  std::vector<std::unique_ptr<CameraReader>> cameras_;
};

}  // namespace emberlock::session
