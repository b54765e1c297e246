// SPDX-License-Identifier: Apache-2.0
#include "session/camera_reader.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "base/kind_of_file.h"
#include "base/unique_fd.h"
#include "session/files.h"

namespace emberlock::session {
namespace fs = std::filesystem;

Result<ParsedIndex> read_index(const fs::path& folder, const std::string& camera_id) {
  const fs::path path = index_path(folder, camera_id);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_file(path, kMaxIndexBytes));
  return parse_index(bytes, path.string());
}

std::size_t end_of_segment(const std::vector<IndexRecord>& records, std::size_t first) {
  std::size_t end = first;
  while (end < records.size() && records[end].segment == records[first].segment) ++end;
  return end;
}

void list_segments(const fs::path& folder, const std::vector<IndexRecord>& records,
                   v1::CameraStream& stream) {
  stream.clear_segments();
  for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
    end = end_of_segment(records, first);
    const std::uint32_t number = records[first].segment;
    const fs::path path = find_segment(folder, stream.camera_id(), number);
    v1::Segment& segment = *stream.add_segments();
    segment.set_file(path.empty() ? segment_name(stream.camera_id(), number, Encoding::ffv1)
                                  : path.lexically_relative(folder).generic_string());
    segment.set_first_frame(first);
    segment.set_frames(end - first);
  }
}

namespace {

/// The records of an index from number `first` up to before `end`; fewer bytes where it has fewer.
Result<std::string> read_part(const fs::path& path, std::uint64_t first, std::uint64_t end) {
  if (end > kMaxIndexBytes / kIndexRecordBytes)
    return Error{ErrorKind::bad_input, "no recording has " + std::to_string(end) + " frames", path.string()};
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd file, open_regular_file(path));
  struct stat info {};
  if (::fstat(file.get(), &info) != 0) return errno_error(path, "cannot stat");
  const std::uint64_t from = kIndexHeaderBytes + first * kIndexRecordBytes;
  const std::uint64_t to =
      std::min(static_cast<std::uint64_t>(info.st_size), kIndexHeaderBytes + end * kIndexRecordBytes);
  std::string bytes(to > from ? to - from : 0, '\0');
  if (::pread(file.get(), bytes.data(), bytes.size(), static_cast<off_t>(from)) !=
      static_cast<ssize_t>(bytes.size()))
    return errno_error(path, "cannot read");
  return bytes;
}

}  // namespace

CameraReader::CameraReader(fs::path folder, std::string camera_id, ImageLayout layout,
                           std::vector<IndexRecord> records, HostClock clock)
    : folder_(std::move(folder)),
      camera_id_(std::move(camera_id)),
      layout_(layout),
      clock_(std::move(clock)),
      records_(std::move(records)) {
  stamps_.reserve(records_.size());
  std::transform(records_.begin(), records_.end(), std::back_inserter(stamps_),
                 [this](const IndexRecord& r) { return on_session(r.stamp); });
}

FrameStamp CameraReader::on_session(FrameStamp stamp) const {
  stamp.monotonic_time = clock_.on_session(stamp.monotonic_time);
  return stamp;
}

Status CameraReader::open_segment(std::uint32_t number) {
  if (segment_ && number_ == number) return {};
  segment_.reset();
  const fs::path path = find_segment(folder_, camera_id_, number);
  if (path.empty()) {
    return Error{ErrorKind::bad_input, "the segment is missing",
                 (folder_ / segment_name(camera_id_, number, Encoding::ffv1)).string(),
                 "Restore the file; frames of other segments stay readable"};
  }
  auto opened = SegmentReader::open(path, layout_);
  // transcode() may have replaced the file since it was found.
  if (const fs::path now = find_segment(folder_, camera_id_, number); !opened && !now.empty() && now != path)
    opened = SegmentReader::open(now, layout_);
  if (!opened) return opened.error();
  segment_ = std::move(opened).value();
  number_ = number;
  return {};
}

Status CameraReader::grow_to(std::uint64_t frames) {
  if (frames <= records_.size()) return {};
  const fs::path path = index_path(folder_, camera_id_);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_part(path, records_.size(), frames));
  EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, parse_index(encode_index_header() + bytes, path.string()));
  const bool follows_on =
      records_.empty() || index.records.empty() || follows(records_.back(), index.records.front());
  if (!follows_on || records_.size() + index.records.size() != frames)
    return Error{ErrorKind::bad_input,
                 "the index has " + std::to_string(records_.size() + index.records.size()) +
                     " good frames of the " + std::to_string(frames) + " that are said to be on the disk",
                 path.string(), "Wait until the recording has ended; then verify it"};
  for (const IndexRecord& record : index.records) {
    records_.push_back(record);
    stamps_.push_back(on_session(record.stamp));
  }
  return {};
}

Status CameraReader::check(std::size_t i) {
  const IndexRecord& record = records_.at(i);
  EMBERLOCK_RETURN_IF_ERROR(open_segment(record.segment));
  return segment_->check(record.segment_ms, record.pixel_hash);
}

Result<Frame> CameraReader::read(std::size_t i) {
  if (i >= records_.size()) {
    return Error{ErrorKind::out_of_data, "the recording has ended", "camera " + camera_id_};
  }
  const IndexRecord& record = records_[i];
  const auto locate = [&](Error error) {
    error.where += ", frame " + std::to_string(i) + " (id " + std::to_string(record.stamp.frame_id) + ")";
    return error;
  };
  if (const Status opened = open_segment(record.segment); !opened) return locate(opened.error());
  auto image = segment_->read(record.segment_ms);
  if (!image) return locate(image.error());
  if (pixel_hash(image->bytes()) != record.pixel_hash) {
    return locate({ErrorKind::bad_input, "the pixels aren't those that were recorded",
                   find_segment(folder_, camera_id_, record.segment).string(),
                   "Leave this frame out, or restore the file"});
  }
  return Frame{stamps_[i], std::make_shared<const Image>(std::move(image).value())};
}

}  // namespace emberlock::session
