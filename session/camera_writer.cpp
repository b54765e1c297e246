// SPDX-License-Identifier: Apache-2.0
#include "session/camera_writer.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/log.h"
#include "session/camera_reader.h"
#include "session/files.h"
#include "session/layout.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

constexpr Seconds kSpaceCheckInterval{1};
constexpr Seconds kRetryInterval{1};
constexpr Seconds kTroubleOver = 2 * kRetryInterval;
constexpr std::uint64_t kSpaceCheckBytes = std::uint64_t{64} << 20;
constexpr std::uint32_t kLongestGapMs = 60'000;
/// The limit of segments kept open when no other thread syncs.
constexpr std::size_t kEndedSegmentsAtMost = 8;

}  // namespace

CameraWriter::CameraWriter(fs::path folder, std::string camera_id, ImageLayout layout, Hertz rate,
                           const WriterOptions& options)
    : folder_(std::move(folder)),
      camera_id_(std::move(camera_id)),
      layout_(layout),
      rate_(rate),
      options_(options) {}

Result<std::unique_ptr<CameraWriter>> CameraWriter::create(const fs::path& folder,
                                                           const v1::CameraStream& stream,
                                                           const WriterOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  std::error_code ec;
  fs::create_directory(folder / stream.camera_id(), ec);
  const fs::path path = index_path(folder, stream.camera_id());
  UniqueFd index(::open(path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0644));
  if (!index) return errno_error(path, "cannot create");
  EMBERLOCK_RETURN_IF_ERROR(write_fully(index.get(), encode_index_header(), path));
  std::unique_ptr<CameraWriter> writer(
      new CameraWriter(folder, stream.camera_id(), layout, Hertz(stream.frame_rate_hz()), options));
  UniqueFd for_ledger(::fcntl(index.get(), F_DUPFD_CLOEXEC, 0));
  if (!for_ledger) return errno_error(path, "cannot keep the index open");
  writer->index_ = std::move(index);
  // The session's own folder was synced when it was created.
  writer->ledger_ = std::make_unique<SyncLedger>(std::move(for_ledger), path,
                                                 std::vector<fs::path>{folder / stream.camera_id(), folder});
  return writer;
}

Status CameraWriter::write(const Frame& frame) {
  arrivals_.add(frame.stamp.frame_id);
  now_ = frame.stamp.monotonic_time;
  Status written = failed_ ? Status(*failed_) : write_pixels(frame);
  if (written) {
    note_success();
  } else {
    counts_.set_disk(counts_.disk() + 1);
  }
  return written;
}

Status CameraWriter::write_pixels(const Frame& frame) {
  if (!frame.image || frame.image->layout() != layout_) {
    Error other{ErrorKind::bad_input,
                "the frame's size or format isn't the one that the session was created with",
                "camera " + camera_id_ + ", frame " + std::to_string(frame.stamp.frame_id),
                "Give each layout a session of its own"};
    note_refusal(other);
    return other;
  }
  if (Status synced = check_sync(); !synced) {
    refuse(synced.error(), frame.stamp);
    return synced;
  }
  if (refusal_ && frame.stamp.monotonic_time < retry_at_) return *refusal_;
  refusal_.reset();
  if (Status room = make_room(frame.stamp); !room) {
    // Below the floor, free space is checked for each frame: it is cheap, and a frame may fit again.
    if (space_low_) {
      note_refusal(room.error());
    } else {
      refuse(room.error(), frame.stamp);
    }
    return room;
  }
  v1::Segment& segment = *segments_.rbegin();
  IndexRecord record;
  record.stamp = frame.stamp;
  record.pixel_hash = pixel_hash(frame.image->bytes());
  record.file_offset = segment_->bytes();
  record.segment = next_segment_ - 1;
  record.frame_in_segment = static_cast<std::uint32_t>(segment.frames());
  record.segment_ms = next_milliseconds(frame.stamp);

  Status written = segment_->write(*frame.image, record);
  if (written) {
    const auto bytes = encode(record);
    written = write_fully(index_.get(), {bytes.data(), bytes.size()}, index_path(folder_, camera_id_));
  }
  if (!written) {
    abandon_segment(written.error());
    refuse(written.error(), frame.stamp);
    return written;
  }
  bytes_since_check_ += segment_->bytes() - record.file_offset;
  last_milliseconds_ = record.segment_ms;
  segment.set_frames(segment.frames() + 1);
  counts_.set_recorded(counts_.recorded() + 1);
  return {};
}

/// Ensures that a segment is open and that the disk has enough space.
Status CameraWriter::make_room(const FrameStamp& stamp) {
  const bool full = segment_ && (segments_.rbegin()->frames() >= options_.frames_per_segment ||
                                 segment_->bytes() >= options_.bytes_per_segment);
  if (full) EMBERLOCK_RETURN_IF_ERROR(close_segment());
  EMBERLOCK_RETURN_IF_ERROR(check_free_space(stamp));
  return segment_ ? Status{} : open_segment(stamp);
}

Status CameraWriter::check_free_space(const FrameStamp& stamp) {
  const Seconds since = stamp.monotonic_time - space_checked_;
  const bool due =
      space_low_ || !segment_ || abs(since) >= kSpaceCheckInterval || bytes_since_check_ >= kSpaceCheckBytes;
  if (!due) return {};
  std::error_code ec;
  const fs::space_info space = fs::space(folder_, ec);
  if (ec) return Error{ErrorKind::io, "cannot ask for free space: " + ec.message(), folder_.string()};
  space_checked_ = stamp.monotonic_time;
  bytes_since_check_ = 0;
  space_low_ = space.available < options_.min_free_bytes;
  if (!space_low_) return {};
  return Error{ErrorKind::io,
               std::to_string(space.available >> 20) + " MiB free, fewer than the floor of " +
                   std::to_string(options_.min_free_bytes >> 20) + " MiB",
               folder_.string(), "Free space, or record to another disk"};
}

Status CameraWriter::open_segment(const FrameStamp& stamp) {
  const std::string name = segment_name(camera_id_, next_segment_, options_.encoding);
  EMBERLOCK_ASSIGN_OR_RETURN(segment_,
                             SegmentWriter::create(folder_ / name, layout_, options_.encoding, rate_));
  if (Status kept = ledger_->begun(segment_->fd(), folder_ / name); !kept) {
    segment_.reset();
    return kept;
  }
  ++next_segment_;
  v1::Segment& segment = *segments_.Add();
  segment.set_file(name);
  segment.set_first_frame(counts_.recorded());
  segment_start_ = stamp.monotonic_time;
  return {};
}

Status CameraWriter::close_segment() {
  Status closed = segment_->close();
  if (!closed) {
    abandon_segment(closed.error());
    return closed;
  }
  bytes_closed_ += segment_->bytes();
  segment_.reset();
  ledger_->handed(counts_.recorded());
  ledger_->ended();
  // With a syncing thread at most one is left.
  return ledger_->waiting() > kEndedSegmentsAtMost ? sync() : Status{};
}

/// Afterwards no written data is left in this process.
Status CameraWriter::flush() {
  if (failed_) return *failed_;
  EMBERLOCK_RETURN_IF_ERROR(check_sync());
  if (!segment_) return {};
  if (Status flushed = segment_->flush(); !flushed) {
    abandon_segment(flushed.error());
    return flushed;
  }
  ledger_->handed(counts_.recorded());
  return {};
}

/// Handles a failure of another thread's sync. It isn't known which frames after the last good sync are on
/// the disk, so they don't count as recorded.
Status CameraWriter::check_sync() {
  Status synced = ledger_->failure();
  if (!synced) drop_what_is_not_safe(synced.error());
  return synced;
}

void CameraWriter::drop_what_is_not_safe(const Error& why) {
  warn(why);
  if (segment_) bytes_closed_ += segment_->bytes();
  segment_.reset();
  const std::uint64_t safe = ledger_->safe();
  if (const Status cut = cut_index(safe); !cut) {
    failed_ = cut.error();
    return;
  }
  counts_.set_disk(counts_.disk() + counts_.recorded() - safe);
  counts_.set_recorded(safe);
  while (!segments_.empty() && segments_.rbegin()->first_frame() >= safe) segments_.RemoveLast();
  if (!segments_.empty()) segments_.rbegin()->set_frames(safe - segments_.rbegin()->first_frame());
}

void CameraWriter::note_refusal(const Error& why) {
  trouble_ = Trouble{why, trouble_ ? trouble_->first : now_, now_, ledger_->safe()};
}

/// What was written after a refusal counts once it is on the disk: an encoder's buffer takes frames too.
void CameraWriter::note_success() {
  if (trouble_ && now_ - trouble_->newest > kTroubleOver && ledger_->safe() > trouble_->safe)
    trouble_.reset();
}

void CameraWriter::warn(const Error& why) {
  note_refusal(why);
  // A full disk is reported once.
  const auto level = std::exchange(warned_, true) ? spdlog::level::debug : spdlog::level::warn;
  log(LogCategory::session).log(level, "camera {}: {}", camera_id_, why.message());
}

void CameraWriter::refuse(const Error& why, const FrameStamp& stamp) {
  note_refusal(why);
  refusal_ = why;
  retry_at_ = stamp.monotonic_time + kRetryInterval;
}

/// After a failed write: leaves the segment as it is and counts those of its frames that aren't complete on
/// the disk as lost to it.
void CameraWriter::abandon_segment(const Error& why) {
  warn(why);
  bytes_closed_ += segment_->bytes();
  segment_.reset();
  const auto kept = readable_frames();
  v1::Segment& segment = *segments_.rbegin();
  const Status cut = kept ? cut_index(segment.first_frame() + *kept) : Status(kept.error());
  if (!cut) {
    failed_ = cut.error();
    return;
  }
  const std::uint64_t cost = segment.frames() - *kept;
  counts_.set_recorded(counts_.recorded() - cost);
  counts_.set_disk(counts_.disk() + cost);
  segment.set_frames(*kept);
  if (*kept > 0) return;
  std::error_code ec;
  fs::remove(folder_ / segment.file(), ec);
  segments_.RemoveLast();
}

/// How many of the last segment's frames can be read back. The index is checked too, because a failed write
/// may have torn it. Earlier frames reached the disk, so the search runs from the end.
Result<std::uint64_t> CameraWriter::readable_frames() {
  const v1::Segment& segment = *segments_.rbegin();
  const fs::path path = index_path(folder_, camera_id_);
  const auto start = static_cast<off_t>(kIndexHeaderBytes + segment.first_frame() * kIndexRecordBytes);
  std::string bytes(segment.frames() * kIndexRecordBytes, '\0');
  if (::pread(index_.get(), bytes.data(), bytes.size(), start) != static_cast<ssize_t>(bytes.size())) {
    return errno_error(path, "cannot read back");
  }
  EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, parse_index(encode_index_header() + bytes, path.string()));
  std::size_t kept = index.records.size();
  CameraReader reader(folder_, camera_id_, layout_, std::move(index.records));
  while (kept > 0 && !reader.read(kept - 1).ok()) --kept;
  return kept;
}

/// Removes the frames behind the first `frames` from the index and from the ledger.
Status CameraWriter::cut_index(std::uint64_t frames) {
  const auto size = static_cast<off_t>(kIndexHeaderBytes + frames * kIndexRecordBytes);
  if (::ftruncate(index_.get(), size) != 0) {
    return errno_error(index_path(folder_, camera_id_), "cannot cut off what the disk refused");
  }
  ledger_->cut(frames);
  return {};
}

/// The frame's arrival time within its segment, for players; always rising, whatever the clock does.
std::uint32_t CameraWriter::next_milliseconds(const FrameStamp& stamp) const {
  if (segments_.rbegin()->frames() == 0) return 0;
  const std::int64_t elapsed = (stamp.monotonic_time.ns - segment_start_.ns) / 1'000'000;
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(
      elapsed, std::int64_t{last_milliseconds_} + 1, std::int64_t{last_milliseconds_} + kLongestGapMs));
}

CameraProgress CameraWriter::progress() const {
  CameraProgress now;
  now.written = ledger_->handed();
  now.counts.set_disk(counts_.disk());
  if (trouble_)
    now.trouble = DiskTrouble{trouble_->error, trouble_->newest - trouble_->first, failed_.has_value()};
  now.bytes = bytes_closed_ + (segment_ ? segment_->bytes() : 0) + kIndexHeaderBytes +
              counts_.recorded() * kIndexRecordBytes;
  return now;
}

void CameraWriter::count_lost(LossCause cause, std::uint64_t frames) {
  switch (cause) {
    case LossCause::transport:
      return counts_.set_transport(counts_.transport() + frames);
    case LossCause::underrun:
      return counts_.set_underrun(counts_.underrun() + frames);
    case LossCause::queue:
      return counts_.set_queue(counts_.queue() + frames);
    case LossCause::disk:
      return counts_.set_disk(counts_.disk() + frames);
    case LossCause::passed_over:
      return counts_.set_passed_over(counts_.passed_over() + frames);
  }
}

Result<v1::Counts> CameraWriter::reconcile() const {
  struct stat info {};
  if (::fstat(index_.get(), &info) != 0) return errno_error(index_path(folder_, camera_id_), "cannot stat");
  const auto on_disk = static_cast<std::uint64_t>(info.st_size);
  const auto mismatch = [&](const std::string& what) {
    return Error{ErrorKind::io, what, "camera " + camera_id_,
                 "Don't trust this recording; salvage keeps what is whole"};
  };
  if (on_disk != kIndexHeaderBytes + counts_.recorded() * kIndexRecordBytes) {
    return mismatch(std::to_string(counts_.recorded()) + " frames were written, but the index has " +
                    std::to_string(on_disk) + " bytes");
  }
  const std::uint64_t accounted = counts_.recorded() + counts_.queue() + counts_.disk();
  if (arrivals_.delivered() != accounted) {
    return mismatch(std::to_string(arrivals_.delivered()) + " frames arrived, but " +
                    std::to_string(accounted) + " were written or counted as dropped");
  }
  const std::uint64_t by_driver = counts_.transport() + counts_.underrun() + counts_.passed_over();
  if (by_driver > arrivals_.missing()) {
    return mismatch("the driver lost or left " + std::to_string(by_driver) + " frames, but only " +
                    std::to_string(arrivals_.missing()) + " frame ids are missing");
  }
  v1::Counts counts = counts_;
  counts.set_camera_gap(arrivals_.missing() - by_driver);
  return counts;
}

Status CameraWriter::finish(v1::CameraStream& stream) {
  if (segment_) static_cast<void>(close_segment());
  if (const Status synced = sync(); !synced && !failed_) static_cast<void>(check_sync());
  if (!failed_ && ledger_->safe() < counts_.recorded()) {
    drop_what_is_not_safe({ErrorKind::io, "is no regular file, and keeps nothing",
                           (folder_ / segments_.rbegin()->file()).string(), "Remove it"});
  }
  // The removed frames must stay removed after a power cut.
  if (!failed_) EMBERLOCK_RETURN_IF_ERROR(sync());
  if (failed_) return *failed_;
  EMBERLOCK_ASSIGN_OR_RETURN(*stream.mutable_counts(), reconcile());
  *stream.mutable_segments() = segments_;
  return {};
}

}  // namespace emberlock::session
