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

/// One camera's part of a SessionWriter: its folder, index, segments and counts. One thread at a time, except
/// sync() and safe().
class CameraWriter {
 public:
  /// `folder` is the session's, as an absolute path.
  static Result<std::unique_ptr<CameraWriter>> create(const std::filesystem::path& folder,
                                                      const v1::CameraStream& stream,
                                                      const WriterOptions& options);
  Status write(const Frame& frame);
  Status flush();
  Status sync() { return ledger_->sync(); }
  [[nodiscard]] std::uint64_t safe() const { return ledger_->safe(); }
  void count_lost(LossCause cause, std::uint64_t frames);
  [[nodiscard]] CameraProgress progress() const;
  void set_arrivals(const Arrivals& arrivals) { arrivals_ = arrivals; }
  /// Closes the last segment, fills in the stream's segments and counts, and reconciles the counts with the
  /// index on disk. Frames that the disk refused are counted and are no error.
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
  Status check_sync();
  void drop_what_is_not_safe(const Error& why);
  void warn(const Error& why);
  void note_refusal(const Error& why);
  void note_success();
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
  std::uint32_t next_segment_ = 0;                            ///< of the next segment
  google::protobuf::RepeatedPtrField<v1::Segment> segments_;  ///< the last one is open while segment_ is set
  TimePoint segment_start_;
  std::uint32_t last_milliseconds_ = 0;

  TimePoint space_checked_;  ///< by the frames' clock
  std::uint64_t bytes_since_check_ = 0;
  std::uint64_t bytes_closed_ = 0;  ///< of closed segments
  bool space_low_ = true;           ///< also true before the first check

  Arrivals arrivals_;
  v1::Counts counts_;
  std::optional<Error> refusal_;  ///< the disk's last error; the next try is due at retry_at_
  TimePoint retry_at_;            ///< by the frames' clock
  /// The disk's refusals, by the frames' clock.
  struct Trouble {
    Error error;
    TimePoint first, newest;
    std::uint64_t safe = 0;  ///< frames, at the newest
  };
  std::optional<Trouble> trouble_;
  TimePoint now_;  ///< of the newest frame
  bool warned_ = false;
  std::optional<Error> failed_;  ///< the state of the index on disk is unknown: nothing more can be written
};

}  // namespace emberlock::session
