// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <system_error>
#include <utility>

#include "base/file.h"
#include "session/camera_reader.h"
#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"
#include "session/rewrite.h"
#include "session/salvage.h"
#include "session/unindexed.h"
#include "session/verify.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

/// Places of the frames from `first` to `end` that can be read back.
Result<std::vector<std::size_t>> good_frames(CameraReader& reader, const std::string& camera_id,
                                             std::size_t first, std::size_t end, const Observer& observer) {
  std::vector<std::size_t> good;
  for (std::size_t i = first; i < end; ++i) {
    EMBERLOCK_RETURN_IF_ERROR(observe(observer,
                                      static_cast<double>(i - first) / static_cast<double>(end - first),
                                      "reading back " + camera_id));
    if (reader.read(i).ok()) good.push_back(i);
  }
  return good;
}

/// Keeps only the good frames in the camera's files and index. The segments are replaced first: until the
/// index is replaced, it lists only additional frames that were unreadable before.
Result<RepairedCamera> repair_camera(const fs::path& folder, v1::CameraStream& stream,
                                     const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  EMBERLOCK_ASSIGN_OR_RETURN(const ParsedIndex index, read_index(folder, stream.camera_id()));
  const std::vector<IndexRecord> unindexed =
      unindexed_frames(folder, stream.camera_id(), index.records, Search::behind_the_index);
  CameraReader reader(folder, stream.camera_id(), layout, merged(index.records, unindexed));
  const auto& records = reader.records();
  RepairedCamera report{stream.camera_id(), 0, 0, 0, {}};
  std::vector<IndexRecord> kept;
  for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
    end = end_of_segment(records, first);
    const auto count = static_cast<double>(records.size());
    const double from = static_cast<double>(first) / count;
    const double to = static_cast<double>(end) / count;
    const double middle = (from + to) / 2;
    SegmentRewrite rewrite{{}, Encoding::ffv1, Hertz(stream.frame_rate_hz())};
    EMBERLOCK_ASSIGN_OR_RETURN(
        rewrite.frames, good_frames(reader, stream.camera_id(), first, end, part_of(observer, from, middle)));
    for (const std::size_t i : rewrite.frames) kept.push_back(records[i]);
    if (rewrite.frames.empty() || rewrite.frames.size() == end - first) continue;
    const fs::path path = find_segment(folder, stream.camera_id(), records[first].segment);
    if (path.extension() == ".nut") rewrite.encoding = Encoding::raw_nut;
    EMBERLOCK_RETURN_IF_ERROR(rewrite_segment(reader, rewrite, path, part_of(observer, middle, to)));
    report.rewritten.push_back(path.lexically_relative(folder).generic_string());
  }
  report.kept = kept.size();
  report.found =
      static_cast<std::uint64_t>(std::count_if(kept.begin(), kept.end(), [&](const IndexRecord& record) {
        return std::binary_search(unindexed.begin(), unindexed.end(), record, follows);
      }));
  report.lost = index.records.size() - (kept.size() - report.found);
  if (report.lost > 0 || report.found > 0) {
    EMBERLOCK_RETURN_IF_ERROR(
        write_file_atomically(index_path(folder, stream.camera_id()), encode_index(kept)));
    const std::uint64_t disk = stream.counts().disk() + report.lost;
    stream.mutable_counts()->set_recorded(kept.size());
    stream.mutable_counts()->set_disk(disk - std::min(disk, report.found));
  }
  list_segments(folder, kept, stream);
  return report;
}

}  // namespace

Result<RepairReport> repair_session(const fs::path& folder, const Observer& observer) {
  constexpr double kSalvaged = .2;  // share of the work, if the recorder was killed
  EMBERLOCK_ASSIGN_OR_RETURN(const SalvageReport salvaged, salvage(folder, part_of(observer, 0, kSalvaged)));
  const Observer rest = part_of(observer, kSalvaged, 1);
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const EventLog lock,
                             EventLog::open(events_path(folder), EventLog::Mode::reopen));
  RepairReport report;
  report.events_kept = salvaged.events_kept;
  const double cameras = manifest.cameras_size();
  const std::string before = manifest.SerializeAsString();
  for (int i = 0; i < manifest.cameras_size(); ++i) {
    v1::CameraStream& stream = *manifest.mutable_cameras(i);
    EMBERLOCK_ASSIGN_OR_RETURN(RepairedCamera camera,
                               repair_camera(folder, stream, part_of(rest, i / cameras, (i + 1) / cameras)));
    camera.lost += salvaged.cameras.at(static_cast<std::size_t>(i)).lost;
    camera.found += salvaged.cameras.at(static_cast<std::size_t>(i)).found;
    report.cameras.push_back(std::move(camera));
  }
  const bool mended = manifest.SerializeAsString() != before;
  if (mended) {
    manifest.set_state(v1::Manifest::SALVAGED);
    EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  }
  report.changed = salvaged.changed || mended;
  static_cast<void>(observe(observer, 1, "repaired"));
  return report;
}

}  // namespace emberlock::session
