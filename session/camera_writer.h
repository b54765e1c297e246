// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/frame.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "emberlock/v1/session.pb.h"
#include "session/index.h"
#include "session/segment.h"
#include "session/sync_ledger.h"
#include "session/writer.h"

namespace emberlock::session {

/// One camera's part of a SessionWriter: its folder, index, segments and counts. One thread at a time, but
/// for sync() and safe().
class CameraWriter {
 public:
  /// `folder` is the session's, from the root.
  static Result<std::unique_ptr<CameraWriter>> create(const std::filesystem::path& folder,
                                                      const v1::CameraStream& stream,
                                                      const WriterOptions& options);
  Status write(const Frame& frame);
  Status flush();
  Status sync() { return ledger_->sync(); }
  [[nodiscard]] std::uint64_t safe() const { return ledger_->safe(); }
  void count_lost(LossCause cause, std::uint64_t frames);
  [[nodiscard]] WrittenSoFar written() const;
  void set_arrivals(const Arrivals& arrivals) { arrivals_ = arrivals; }
  /// Closes the last segment and fills in the stream's segments and counts, reconciled with the index on
  /// disk. That the disk refused frames is no error: they are counted.
  Status finish(v1::CameraStream& stream);

 private:
  CameraWriter(std::filesystem::path folder, std::string camera_id, ImageLayout layout, Hertz rate,
               const WriterOptions& options);
  Status write_pixels(const Frame& frame);
  Status make_room(const FrameStamp& stamp);
  Status check_free_space(const FrameStamp& stamp);
  Status open_segment(const FrameStamp& stamp);
  Status close_segment();
  void refuse(const Error& why, const FrameStamp& stamp);
  void abandon_segment(const Error& why);
  Result<std::uint64_t> readable_frames();
  Status cut_index(std::uint64_t frames);
  Status heed_sync();
  void drop_what_is_not_safe(const Error& why);
  void warn(const Error& why);
  [[nodiscard]] std::uint32_t next_milliseconds(const FrameStamp& stamp) const;
  Result<v1::Counts> reconcile() const;

  std::filesystem::path folder_;
  std::string camera_id_;
  ImageLayout layout_;
  Hertz rate_;
  WriterOptions options_;

  UniqueFd index_;
  std::unique_ptr<SyncLedger> ledger_;
  std::unique_ptr<SegmentWriter> segment_;
  std::uint32_t next_segment_ = 0;                            ///< number of the one that is begun next
  google::protobuf::RepeatedPtrField<v1::Segment> segments_;  ///< the last is open while segment_ is
  TimePoint segment_start_;
  std::uint32_t last_milliseconds_ = 0;

  TimePoint space_checked_;  ///< by the frames' clock
  std::uint64_t bytes_since_check_ = 0;
  std::uint64_t bytes_closed_ = 0;  ///< of segments that are closed
  bool space_low_ = true;           ///< or not yet looked

  Arrivals arrivals_;
  v1::Counts counts_;
  std::optional<Error> refusal_;  ///< the disk's last, a retry of which is due at retry_at_
  TimePoint retry_at_;            ///< by the frames' clock
  bool warned_ = false;
  std::optional<Error> failed_;  ///< the index on disk isn't known any more: nothing can be written
};

}  // namespace emberlock::session
