// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "session/host_clock.h"
#include "session/index.h"
#include "session/segment.h"

namespace emberlock::session {

/// One camera's part of a SessionReader: its index, and the segment that was read last. One thread at a time.
class CameraReader {
 public:
  /// `clock`: of the stamps in the records.
  CameraReader(std::filesystem::path folder, std::string camera_id, ImageLayout layout,
               std::vector<IndexRecord> records, HostClock clock = {});

  [[nodiscard]] const ImageLayout& layout() const { return layout_; }
  /// On the session's clock, like those of the frames that read() returns.
  [[nodiscard]] const std::vector<FrameStamp>& stamps() const { return stamps_; }
  /// As the index has them: on the clock of the host that recorded them.
  [[nodiscard]] const std::vector<IndexRecord>& records() const { return records_; }
  Result<Frame> read(std::size_t i);
  /// Takes the frames of a recording that goes on up to the first `frames`, which are on the disk. Errors:
  /// bad_input (the index has fewer, or a damaged one), io.
  Status grow_to(std::uint64_t frames);
  /// The segment has grown since it was opened: the next read() opens it as it is by then.
  void close_segment() { segment_.reset(); }
  /// Whether read(i) would succeed, as far as this can be told without decoding: SegmentReader::check.
  Status check(std::size_t i);

 private:
  Status open_segment(std::uint32_t number);
  [[nodiscard]] FrameStamp on_session(FrameStamp stamp) const;

  std::filesystem::path folder_;
  std::string camera_id_;
  ImageLayout layout_;
  HostClock clock_;
  std::vector<IndexRecord> records_;
  std::vector<FrameStamp> stamps_;
  std::optional<SegmentReader> segment_;
  std::uint32_t number_ = 0;  ///< of segment_
};

/// Index of the first record after `first` that is in another segment; the end if there is none.
std::size_t end_of_segment(const std::vector<IndexRecord>& records, std::size_t first);

/// Builds the manifest's list of segments from the records.
void list_segments(const std::filesystem::path& folder, const std::vector<IndexRecord>& records,
                   v1::CameraStream& stream);

/// The records of a camera's index file, and the damage found in it.
Result<ParsedIndex> read_index(const std::filesystem::path& folder, const std::string& camera_id);

}  // namespace emberlock::session
