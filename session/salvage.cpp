#include "session/salvage.h"

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include <unistd.h>

#include "base/file.h"
#include "session/camera_reader.h"
#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

std::string encode_index(const std::vector<IndexRecord>& records) {
  std::string bytes = encode_index_header();
  for (const IndexRecord& record : records) {
    const auto encoded = encode(record);
    bytes.append(encoded.data(), encoded.size());
  }
  return bytes;
}

/// How many of the last segment's frames, counted from its first, decode to what was recorded.
std::size_t count_decodable(CameraReader& reader, std::size_t first, std::size_t end) {
  std::size_t i = first;
  while (i < end && reader.read(i).ok()) ++i;
  return i - first;
}

void list_segments(const fs::path& folder, const std::vector<IndexRecord>& records,
                   v1::CameraStream& stream) {
  stream.clear_segments();
  for (std::size_t i = 0; i < records.size(); ++i) {
    if (i == 0 || records[i].segment != records[i - 1].segment) {
      v1::Segment& segment = *stream.add_segments();
      const fs::path path = find_segment(folder, stream.camera_id(), records[i].segment);
      segment.set_file(path.empty() ? segment_name(stream.camera_id(), records[i].segment, Encoding::ffv1)
                                    : path.lexically_relative(folder).generic_string());
      segment.set_first_frame(i);
    }
    v1::Segment& last = *stream.mutable_segments()->rbegin();
    last.set_frames(last.frames() + 1);
  }
}

Result<SalvagedCamera> salvage_camera(const fs::path& folder, v1::CameraStream& stream) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  std::vector<IndexRecord> records;
  SalvagedCamera report{stream.camera_id()};
  std::error_code ec;
  const fs::path path = index_path(folder, stream.camera_id());
  if (fs::exists(path, ec)) {  // else killed before this camera's turn came
    EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, read_index(folder, stream.camera_id()));
    records = std::move(index.records);
    report.lost = index.bad_records;
  }
  if (!records.empty()) {
    const auto last = std::find_if(records.rbegin(), records.rend(),
                                   [&](const IndexRecord& r) { return r.segment != records.back().segment; });
    const auto first = static_cast<std::size_t>(records.rend() - last);
    CameraReader reader(folder, stream.camera_id(), layout, records);
    const std::size_t good = count_decodable(reader, first, records.size());
    report.lost += records.size() - first - good;
    records.resize(first + good);
  }
  fs::create_directory(path.parent_path(), ec);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(path, encode_index(records)));
  Arrivals arrivals;
  for (const IndexRecord& record : records) arrivals.add(record.stamp.frame_id);
  report.kept = records.size();
  v1::Counts& counts = *stream.mutable_counts();
  counts.Clear();
  counts.set_recorded(report.kept);
  counts.set_disk(report.lost);
  // Which cause took the ids that are missing died with the recorder's counters.
  counts.set_camera_gap(arrivals.missing());
  list_segments(folder, records, stream);
  return report;
}

Result<std::uint64_t> salvage_events(const fs::path& folder) {
  const fs::path path = events_path(folder);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  const ParsedEvents parsed = parse_events(bytes);
  if (parsed.valid_bytes != bytes.size() &&
      ::truncate(path.c_str(), static_cast<off_t>(parsed.valid_bytes)) != 0) {
    return errno_error(path, "cannot cut the torn end off");
  }
  return parsed.events.size();
}

bool index_is_whole(const fs::path& folder, const v1::CameraStream& stream) {
  const auto index = read_index(folder, stream.camera_id());
  return index.ok() && index->whole() && index->records.size() == stream.counts().recorded();
}

}  // namespace

Result<SalvageReport> salvage(const fs::path& folder, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const EventLog lock,
                             EventLog::open(events_path(folder), EventLog::Mode::reopen));
  drop_reserve(folder);
  SalvageReport report;
  EMBERLOCK_ASSIGN_OR_RETURN(report.events_kept, salvage_events(folder));
  bool repaired = false;
  for (int i = 0; i < manifest.cameras_size(); ++i) {
    v1::CameraStream& camera = *manifest.mutable_cameras(i);
    emberlock::report(progress, static_cast<double>(i) / manifest.cameras_size(),
                      "salvaging " + camera.camera_id());
    if (manifest.state() != v1::Manifest::RECORDING && index_is_whole(folder, camera)) {
      report.cameras.push_back({camera.camera_id(), camera.counts().recorded(), 0});
      continue;
    }
    EMBERLOCK_ASSIGN_OR_RETURN(SalvagedCamera salvaged, salvage_camera(folder, camera));
    report.cameras.push_back(std::move(salvaged));
    repaired = true;
  }
  if (repaired) {
    manifest.set_state(v1::Manifest::SALVAGED);
    EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  }
  emberlock::report(progress, 1, "salvaged");
  return report;
}

}  // namespace emberlock
