#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <string>
#include <system_error>
#include <utility>

#include "session/camera_reader.h"
#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"
#include "session/salvage.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

struct Job {
  fs::path folder;
  std::string camera_id;
  ImageLayout layout;
  Hertz rate;
};

/// Every frame of `path` decodes to the pixels that the index promises.
Status verify(const Job& job, const fs::path& path, const std::vector<IndexRecord>& records) {
  EMBERLOCK_ASSIGN_OR_RETURN(SegmentReader segment, SegmentReader::open(path, job.layout));
  for (const IndexRecord& record : records) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Image image, segment.read(record.segment_ms));
    if (pixel_hash(image.bytes()) != record.pixel_hash) {
      return Error{ErrorKind::io,
                   "transcoding changed the pixels of frame " + std::to_string(record.stamp.frame_id),
                   path.string(), "Check memory and disk; the uncompressed segment is kept"};
    }
  }
  return {};
}

Status encode_segment(const Job& job, CameraReader& reader, const fs::path& target, std::size_t first,
                      std::size_t end) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto writer,
                             SegmentWriter::create(target, job.layout, Encoding::ffv1, job.rate));
  for (std::size_t i = first; i < end; ++i) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame, reader.read(i));
    EMBERLOCK_RETURN_IF_ERROR(writer->write(*frame.image, reader.records()[i].segment_ms));
  }
  return writer->close();
}

/// Replaces one uncompressed segment. The reader prefers the compressed one as soon as it has its name.
Status transcode_segment(const Job& job, CameraReader& reader, std::size_t first, std::size_t end) {
  const auto& records = reader.records();
  const std::uint32_t number = records[first].segment;
  const fs::path raw = job.folder / segment_name(job.camera_id, number, Encoding::raw_nut);
  const fs::path target = job.folder / segment_name(job.camera_id, number, Encoding::ffv1);
  std::error_code ec;
  if (!fs::exists(raw, ec)) return {};
  if (!fs::exists(target, ec)) {
    fs::path partial = target;
    partial += ".partial";
    Status done = encode_segment(job, reader, partial, first, end);
    if (done) {
      done = verify(job, partial,
                    {records.begin() + static_cast<std::ptrdiff_t>(first),
                     records.begin() + static_cast<std::ptrdiff_t>(end)});
    }
    if (!done) {
      fs::remove(partial, ec);
      return done;
    }
    fs::rename(partial, target, ec);
    if (ec) return Error{ErrorKind::io, "cannot rename into place: " + ec.message(), target.string()};
  }
  fs::remove(raw, ec);
  return {};
}

Status transcode_camera(const fs::path& folder, v1::CameraStream& stream, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, read_index(folder, stream.camera_id()));
  const Job job{folder, stream.camera_id(), layout, Hertz(stream.frame_rate_hz())};
  CameraReader reader(folder, stream.camera_id(), layout, std::move(index.records));
  const auto& records = reader.records();
  for (std::size_t first = 0; first < records.size();) {
    std::size_t end = first;
    while (end < records.size() && records[end].segment == records[first].segment) ++end;
    report(progress, static_cast<double>(first) / static_cast<double>(records.size()),
           "compressing " + stream.camera_id());
    EMBERLOCK_RETURN_IF_ERROR(transcode_segment(job, reader, first, end));
    first = end;
  }
  for (v1::Segment& segment : *stream.mutable_segments()) {
    const fs::path ffv1 = fs::path(segment.file()).replace_extension(".mkv");
    std::error_code ec;
    if (fs::exists(folder / ffv1, ec)) segment.set_file(ffv1.generic_string());
  }
  return {};
}

}  // namespace

Status transcode(const fs::path& folder, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const EventLog lock,
                             EventLog::open(events_path(folder), EventLog::Mode::reopen));
  if (manifest.state() == v1::Manifest::RECORDING) {
    return Error{ErrorKind::bad_input, "the recording isn't finished", folder.string(), "Salvage it first"};
  }
  const double cameras = manifest.cameras_size();
  for (int i = 0; i < manifest.cameras_size(); ++i) {
    const Progress part = [&](double fraction, std::string_view what) {
      report(progress, (i + fraction) / cameras, what);
    };
    EMBERLOCK_RETURN_IF_ERROR(transcode_camera(folder, *manifest.mutable_cameras(i), part));
  }
  report(progress, 1, "compressed");
  return write_manifest(folder, manifest);
}

}  // namespace emberlock
