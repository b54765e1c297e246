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

/// How many of the last segment's frames, counted from its first, decode to what was recorded.
std::size_t count_decodable(CameraReader& reader, std::size_t first, std::size_t end) {
  std::size_t i = first;
  while (i < end && reader.read(i).ok()) ++i;
  return i - first;
}

/// The index's records as far as each stands for itself, even behind a damaged header.
Result<ParsedIndex> read_what_is_left(const fs::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string bytes, read_file(path, kMaxIndexBytes));
  const std::string header = encode_index_header();
  const bool foreign = bytes.size() >= header.size() && !bytes.starts_with(header);
  if (foreign) bytes.replace(0, header.size(), header);
  EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, parse_index(bytes, path.string()));
  if (foreign && index.records.empty()) return parse_index("no index", path.string());
  return index;
}

/// A recorder that was killed leaves a last segment of which the end is missing: how many of its frames are
/// lost.
std::uint64_t cut_last_segment(CameraReader& reader, std::vector<IndexRecord>& records) {
  if (records.empty()) return 0;
  const auto last = std::find_if(records.rbegin(), records.rend(),
                                 [&](const IndexRecord& r) { return r.segment != records.back().segment; });
  const auto first = static_cast<std::size_t>(records.rend() - last);
  const std::size_t kept = first + count_decodable(reader, first, records.size());
  const std::uint64_t lost = records.size() - kept;
  records.resize(kept);
  return lost;
}

/// What the manifest says of the frames' whereabouts, when `kept` of them stay and `lost` go.
v1::Counts counts_of(const v1::Counts& before, v1::Manifest::State state,
                     const std::vector<IndexRecord>& records, std::uint64_t lost) {
  v1::Counts counts = before;
  if (state == v1::Manifest::RECORDING) {
    Arrivals arrivals;
    for (const IndexRecord& record : records) arrivals.add(record.stamp.frame_id);
    counts.Clear();
    counts.set_disk(lost);
    // Which cause took the ids that are missing died with the recorder's counters.
    counts.set_camera_gap(arrivals.missing());
  } else {
    counts.set_disk(before.disk() + before.recorded() -
                    std::min<std::uint64_t>(before.recorded(), records.size()));
  }
  counts.set_recorded(records.size());
  return counts;
}

Result<SalvagedCamera> salvage_camera(const fs::path& folder, v1::Manifest::State state,
                                      v1::CameraStream& stream) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  ParsedIndex index;
  std::error_code ec;
  const fs::path path = index_path(folder, stream.camera_id());
  if (fs::exists(path, ec)) {  // else killed before this camera's turn came
    EMBERLOCK_ASSIGN_OR_RETURN(index, read_what_is_left(path));
  }
  std::vector<IndexRecord> records = index.records;
  SalvagedCamera report{stream.camera_id()};
  report.lost = index.bad_records;
  if (state == v1::Manifest::RECORDING) {
    CameraReader reader(folder, stream.camera_id(), layout, records);
    report.lost += cut_last_segment(reader, records);
  } else {
    const std::uint64_t before = stream.counts().recorded();
    report.lost = before - std::min<std::uint64_t>(before, records.size());
  }
  fs::create_directory(path.parent_path(), ec);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(path, encode_index(records)));
  report.kept = records.size();
  *stream.mutable_counts() = counts_of(stream.counts(), state, records, report.lost);
  list_segments(folder, records, stream);
  return report;
}

Status salvage_events(const fs::path& folder, SalvageReport& report) {
  const fs::path path = events_path(folder);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  const ParsedEvents parsed = parse_events(bytes);
  report.events_kept = parsed.events.size();
  if (parsed.valid_bytes == bytes.size()) return {};
  report.changed = true;
  if (::truncate(path.c_str(), static_cast<off_t>(parsed.valid_bytes)) != 0) {
    return errno_error(path, "cannot cut the torn end off");
  }
  return {};
}

bool index_is_whole(const fs::path& folder, const v1::CameraStream& stream) {
  const auto index = read_index(folder, stream.camera_id());
  return index.ok() && index->whole() && index->records.size() == stream.counts().recorded();
}

}  // namespace

Result<SalvageReport> salvage(const fs::path& folder, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  std::error_code ec;
  const bool had_events = fs::exists(events_path(folder), ec);
  EMBERLOCK_ASSIGN_OR_RETURN(const EventLog lock,
                             EventLog::open(events_path(folder), EventLog::Mode::reopen));
  drop_reserve(folder);
  SalvageReport report;
  report.changed = manifest.state() == v1::Manifest::RECORDING || !had_events;
  EMBERLOCK_RETURN_IF_ERROR(salvage_events(folder, report));
  bool repaired = manifest.state() == v1::Manifest::RECORDING;
  for (int i = 0; i < manifest.cameras_size(); ++i) {
    v1::CameraStream& camera = *manifest.mutable_cameras(i);
    emberlock::report(progress, static_cast<double>(i) / manifest.cameras_size(),
                      "salvaging " + camera.camera_id());
    if (manifest.state() != v1::Manifest::RECORDING && index_is_whole(folder, camera)) {
      report.cameras.push_back({camera.camera_id(), camera.counts().recorded(), 0});
      continue;
    }
    EMBERLOCK_ASSIGN_OR_RETURN(SalvagedCamera salvaged, salvage_camera(folder, manifest.state(), camera));
    report.cameras.push_back(std::move(salvaged));
    repaired = true;
  }
  if (repaired) {
    report.changed = true;
    manifest.set_state(v1::Manifest::SALVAGED);
    EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  }
  emberlock::report(progress, 1, "salvaged");
  return report;
}

}  // namespace emberlock
