#include "session/camera_reader.h"

#include <algorithm>
#include <iterator>
#include <memory>
#include <utility>

#include "base/file.h"
#include "session/files.h"

namespace emberlock {
namespace fs = std::filesystem;

Result<ParsedIndex> read_index(const fs::path& folder, const std::string& camera_id) {
  const fs::path path = index_path(folder, camera_id);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_file(path, std::size_t{4} << 30));
  return parse_index(bytes, path.string());
}

CameraReader::CameraReader(fs::path folder, std::string camera_id, ImageLayout layout,
                           std::vector<IndexRecord> records)
    : folder_(std::move(folder)),
      camera_id_(std::move(camera_id)),
      layout_(layout),
      records_(std::move(records)) {
  stamps_.reserve(records_.size());
  std::transform(records_.begin(), records_.end(), std::back_inserter(stamps_),
                 [](const IndexRecord& r) { return r.stamp; });
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
  EMBERLOCK_ASSIGN_OR_RETURN(segment_, SegmentReader::open(path, layout_));
  number_ = number;
  return {};
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
  return Frame{record.stamp, std::make_shared<const Image>(std::move(image).value())};
}

}  // namespace emberlock
