// SPDX-License-Identifier: Apache-2.0
#include "session/rewrite.h"

#include <string>
#include <system_error>
#include <utility>

#include "base/file.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

Status write_frames(CameraReader& reader, const SegmentRewrite& what, const fs::path& target,
                    const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto writer,
                             SegmentWriter::create(target, reader.layout(), what.encoding, what.rate));
  const auto count = static_cast<double>(what.frames.size());
  for (std::size_t i = 0; i < what.frames.size(); ++i) {
    EMBERLOCK_RETURN_IF_ERROR(
        observe(observer, static_cast<double>(i) / count, "writing " + target.string()));
    EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame, reader.read(what.frames[i]));
    EMBERLOCK_RETURN_IF_ERROR(writer->write(*frame.image, reader.records()[what.frames[i]]));
  }
  EMBERLOCK_RETURN_IF_ERROR(writer->close());
  return writer->sync();
}

}  // namespace

Status read_back(const fs::path& path, const ImageLayout& layout, std::span<const IndexRecord> records,
                 const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(SegmentReader segment, SegmentReader::open(path, layout));
  for (std::size_t i = 0; i < records.size(); ++i) {
    EMBERLOCK_RETURN_IF_ERROR(observe(observer, static_cast<double>(i) / static_cast<double>(records.size()),
                                      "reading back " + path.string()));
    EMBERLOCK_ASSIGN_OR_RETURN(const Image image, segment.read(records[i].segment_ms));
    if (pixel_hash(image.bytes()) != records[i].pixel_hash) {
      return Error{ErrorKind::io,
                   "frame " + std::to_string(records[i].stamp.frame_id) + " came back with other pixels",
                   path.string(), "Check memory and disk; what it was made from is kept"};
    }
  }
  return {};
}

Status rewrite_segment(CameraReader& reader, const SegmentRewrite& what, const fs::path& target,
                       const Observer& observer) {
  fs::path partial = target;
  partial += ".partial";
  Status done = write_frames(reader, what, partial, part_of(observer, 0, .6));
  if (done) {
    std::vector<IndexRecord> records;
    for (const std::size_t i : what.frames) records.push_back(reader.records()[i]);
    done = read_back(partial, reader.layout(), records, part_of(observer, .6, 1));
  }
  std::error_code ec;
  if (!done) {
    fs::remove(partial, ec);
    return done;
  }
  fs::rename(partial, target, ec);
  if (ec) return Error{ErrorKind::io, "cannot rename into place: " + ec.message(), target.string()};
  return sync_folder(target.parent_path());  // before the source may be deleted
}

}  // namespace emberlock::session
