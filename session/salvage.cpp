// SPDX-License-Identifier: Apache-2.0
#include "session/salvage.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <mutex>
#include <optional>
#include <set>
#include <system_error>
#include <utility>

#include <unistd.h>

#include "base/file.h"
#include "base/in_parallel.h"
#include "session/camera_reader.h"
#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"
#include "session/unindexed.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

/// The index's valid records, even behind a damaged header.
Result<ParsedIndex> read_what_is_left(const fs::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string bytes, read_file(path, kMaxIndexBytes));
  const std::string header = encode_index_header();
  const bool foreign = bytes.size() >= header.size() && !bytes.starts_with(header);
  if (foreign) bytes.replace(0, header.size(), header);
  EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, parse_index(bytes, path.string()));
  if (foreign && index.records.empty()) return parse_index("no index", path.string());
  return index;
}

std::pair<std::uint32_t, std::uint32_t> place(const IndexRecord& record) {
  return {record.segment, record.frame_in_segment};
}

/// Segments of a killed recording that may have holes or a missing end. While one sync ran from the data to
/// the index, more frames were written to both, and a segment may have ended and the next begun. So these are
/// the last two segments, and every other one that is shorter than the index says.
std::set<std::uint32_t> segments_in_doubt(const fs::path& folder, const std::string& camera_id,
                                          const std::vector<IndexRecord>& all) {
  std::set<std::uint32_t> doubted;
  std::size_t segments = 0;
  for (auto last = all.rbegin(); last != all.rend(); ++last) {
    if (last != all.rbegin() && std::prev(last)->segment == last->segment) continue;
    std::error_code ec;
    const auto bytes = fs::file_size(find_segment(folder, camera_id, last->segment), ec);
    if (++segments <= 2 || ec || bytes <= last->file_offset) doubted.insert(last->segment);
  }
  return doubted;
}

/// The frames of a recording that are complete on the disk. Frames in the index are, except in the segments
/// in doubt. Frames that only the segments know must be checked.
Result<std::vector<IndexRecord>> keep_whole(const fs::path& folder, const v1::CameraStream& stream,
                                            v1::Manifest::State state, const std::vector<IndexRecord>& index,
                                            const std::vector<IndexRecord>& found, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  const std::vector<IndexRecord> all = merged(index, found);
  CameraReader reader(folder, stream.camera_id(), layout, all);
  std::set<std::uint32_t> doubted;
  if (state == v1::Manifest::RECORDING) doubted = segments_in_doubt(folder, stream.camera_id(), all);
  std::vector<IndexRecord> kept;
  std::optional<std::size_t> last_checked;  // the last kept frame that was checked; it isn't decoded
  auto next_found = found.begin();
  for (std::size_t i = 0; i < all.size(); ++i) {
    EMBERLOCK_RETURN_IF_ERROR(
        observe(observer, static_cast<double>(i) / static_cast<double>(all.size()), "salvaging"));
    // A record that contradicts its neighbours isn't in the merged list.
    while (next_found != found.end() && place(*next_found) < place(all[i])) ++next_found;
    const bool is_new = next_found != found.end() && all[i] == *next_found;
    if (!is_new && !doubted.contains(all[i].segment)) {
      kept.push_back(all[i]);
    } else if (reader.check(i).ok() || reader.read(i).ok()) {
      kept.push_back(all[i]);
      last_checked = i;
    }
  }
  // FFV1's checksums are trusted; of all frames checked by them only the last one is decoded.
  while (last_checked && !kept.empty() && kept.back() == all[*last_checked] &&
         !reader.read(*last_checked).ok()) {
    kept.pop_back();
    last_checked = *last_checked > 0 ? std::optional(*last_checked - 1) : std::nullopt;
  }
  return kept;
}

/// The manifest's counts for a killed recording: `kept` of `known` frames are kept, of which `told` have a
/// record.
v1::Counts counts_of_killed(std::uint64_t kept, std::uint64_t known, const std::vector<IndexRecord>& told) {
  Arrivals arrivals;
  for (const IndexRecord& record : told) arrivals.add(record.stamp.frame_id);
  const std::uint64_t untold = known - std::min<std::uint64_t>(known, told.size());
  v1::Counts counts;
  counts.set_recorded(kept);
  counts.set_disk(known - std::min(known, kept));
  // The causes of the other missing ids were lost with the recorder's counters.
  counts.set_camera_gap(arrivals.missing() - std::min(arrivals.missing(), untold));
  return counts;
}

v1::Counts counts_of_finished(const v1::Counts& before, std::uint64_t kept) {
  v1::Counts counts = before;
  counts.set_disk(before.disk() + before.recorded() - std::min(before.recorded(), kept));
  counts.set_recorded(kept);
  return counts;
}

/// One camera's stream after salvage.
struct SalvagedStream {
  SalvagedCamera report;
  v1::CameraStream stream;
  std::vector<IndexRecord> records;
};

/// Finds out what is left; changes nothing.
Result<SalvagedStream> examine_camera(const fs::path& folder, v1::Manifest::State state,
                                      const v1::CameraStream& stream, const Observer& observer) {
  ParsedIndex index;
  std::error_code ec;
  const fs::path path = index_path(folder, stream.camera_id());
  if (fs::exists(path, ec)) {  // missing if the recorder was killed before it created this camera
    EMBERLOCK_ASSIGN_OR_RETURN(index, read_what_is_left(path));
  }
  const bool recording = state == v1::Manifest::RECORDING;
  const Search search = recording && index.bad_records == 0 ? Search::behind_the_index : Search::everywhere;
  const std::vector<IndexRecord> found = unindexed_frames(folder, stream.camera_id(), index.records, search);
  SalvagedStream left{{stream.camera_id()}, stream, {}};
  EMBERLOCK_ASSIGN_OR_RETURN(left.records, keep_whole(folder, stream, state, index.records, found, observer));
  const std::vector<IndexRecord>& records = left.records;
  left.report.found =
      static_cast<std::uint64_t>(std::count_if(found.begin(), found.end(), [&](const IndexRecord& record) {
        return std::binary_search(records.begin(), records.end(), record, follows);
      }));
  // Bad records belong to frames that the segments list again, or to unknown ones. There are no records
  // behind the index.
  const auto behind =
      static_cast<std::uint64_t>(std::count_if(found.begin(), found.end(), [&](const IndexRecord& record) {
        return index.records.empty() || follows(index.records.back(), record);
      }));
  const std::uint64_t known =
      recording
          ? index.records.size() + std::max<std::uint64_t>(index.bad_records, found.size() - behind) + behind
          : std::max<std::uint64_t>(stream.counts().recorded(), records.size());
  left.report.lost = known - std::min<std::uint64_t>(known, records.size());
  left.report.kept = records.size();
  *left.stream.mutable_counts() = recording
                                      ? counts_of_killed(records.size(), known, merged(index.records, found))
                                      : counts_of_finished(stream.counts(), records.size());
  list_segments(folder, records, left.stream);
  return left;
}

/// The path at which a killed recording's new index waits until the manifest refers to it.
fs::path new_index_path(const fs::path& folder, const std::string& camera_id) {
  fs::path path = index_path(folder, camera_id);
  path += ".salvaged";
  return path;
}

Status write_new_index(const fs::path& folder, const SalvagedStream& left) {
  const fs::path path = new_index_path(folder, left.report.camera_id);
  std::error_code ec;
  fs::create_directory(path.parent_path(), ec);
  return write_file_atomically(path, encode_index(left.records));
}

/// Does nothing if there is no new index: it was installed before.
Status install_new_index(const fs::path& folder, const std::string& camera_id) {
  const fs::path path = new_index_path(folder, camera_id);
  std::error_code ec;
  if (!fs::exists(path, ec)) return {};
  fs::rename(path, index_path(folder, camera_id), ec);
  if (ec) return Error{ErrorKind::io, "cannot rename into place: " + ec.message(), path.string()};
  return sync_folder(path.parent_path());
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

Result<SalvageReport> salvage(const fs::path& folder, const Observer& observer) {
  EMBERLOCK_RETURN_IF_ERROR(observe(observer, 0, "salvaging"));
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  std::error_code ec;
  const bool had_events = fs::exists(events_path(folder), ec);
  EMBERLOCK_ASSIGN_OR_RETURN(const EventLog lock,
                             EventLog::open(events_path(folder), EventLog::Mode::reopen));
  drop_reserve(folder);
  const v1::Manifest::State state = manifest.state();
  const bool killed = state == v1::Manifest::RECORDING;
  SalvageReport report;
  report.changed = killed || !had_events;
  EMBERLOCK_RETURN_IF_ERROR(salvage_events(folder, report));
  const auto cameras = static_cast<std::size_t>(manifest.cameras_size());
  report.cameras.resize(cameras);
  std::mutex mutex;  // guards the manifest and the results
  bool repaired = killed;
  const auto salvage_camera = [&](std::size_t i, const Observer& seen) -> Status {
    v1::CameraStream& of_manifest = *manifest.mutable_cameras(static_cast<int>(i));
    const v1::CameraStream before = [&] {
      const std::lock_guard guard(mutex);
      return of_manifest;
    }();
    // In a killed recording only an earlier salvage can have written counts.
    const bool was_here = killed && before.has_counts();
    if (was_here) EMBERLOCK_RETURN_IF_ERROR(install_new_index(folder, before.camera_id()));
    if ((was_here || !killed) && index_is_whole(folder, before)) {
      report.cameras[i] = {before.camera_id(), before.counts().recorded(),
                           killed ? before.counts().disk() : 0};
      return {};
    }
    EMBERLOCK_ASSIGN_OR_RETURN(const SalvagedStream left, examine_camera(folder, state, before, seen));
    report.cameras[i] = left.report;
    EMBERLOCK_RETURN_IF_ERROR(write_new_index(folder, left));
    {
      const std::lock_guard guard(mutex);
      of_manifest = left.stream;
      repaired = true;
      // If salvage is interrupted now, the next run learns the losses from the manifest, since the new index
      // doesn't show them.
      if (killed) EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
    }
    return install_new_index(folder, left.report.camera_id);
  };
  EMBERLOCK_RETURN_IF_ERROR(in_parallel(cameras, observer, salvage_camera));
  if (repaired) {
    report.changed = true;
    manifest.set_state(v1::Manifest::SALVAGED);
    EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  }
  static_cast<void>(observe(observer, 1, "salvaged"));
  return report;
}

}  // namespace emberlock::session
