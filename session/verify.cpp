// SPDX-License-Identifier: Apache-2.0
#include "session/verify.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "base/file.h"
#include "base/in_parallel.h"
#include "session/camera_reader.h"
#include "session/certificate.h"
#include "session/events.h"
#include "session/files.h"
#include "session/layout.h"
#include "session/unindexed.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

std::string of(std::uint64_t part, std::uint64_t whole) {
  return std::to_string(part) + " of " + std::to_string(whole) + " frames";
}

/// The records of a camera's index; faults are added to the check's problems.
std::vector<IndexRecord> check_index(const fs::path& folder, v1::Manifest::State state,
                                     const v1::CameraStream& stream, CameraCheck& check) {
  const std::string file = index_path(folder, stream.camera_id()).lexically_relative(folder).string();
  auto index = read_index(folder, stream.camera_id());
  const bool finished = state != v1::Manifest::RECORDING;
  if (!index) {
    check.recorded = finished ? stream.counts().recorded() : 0;
    check.missing = check.recorded;
    check.problems.push_back(file + ": " + index.error().what);
    return {};
  }
  const std::size_t records = index->records.size();
  check.recorded = finished ? stream.counts().recorded() : records + index->bad_records;
  check.missing = check.recorded - std::min<std::uint64_t>(check.recorded, records);
  if (!index->whole()) {
    check.problems.push_back(file + ": damaged: " + std::to_string(index->bad_records) + " bad records, " +
                             std::to_string(index->torn_bytes) + " bytes of a torn one");
  }
  if (finished && check.recorded != records) {
    check.problems.push_back(file + ": holds " + of(records, check.recorded) + " that the manifest counts");
  }
  return std::move(index->records);
}

/// Compares the manifest's list of segments with the index. File extensions are ignored, since transcoding
/// changes them.
void check_segments(const fs::path& folder, const std::vector<IndexRecord>& records,
                    const v1::CameraStream& stream, CameraCheck& check) {
  v1::CameraStream expected = stream;
  list_segments(folder, records, expected);
  const auto same = [](const v1::Segment& a, const v1::Segment& b) {
    return fs::path(a.file()).replace_extension() == fs::path(b.file()).replace_extension() &&
           a.first_frame() == b.first_frame() && a.frames() == b.frames();
  };
  if (!std::equal(stream.segments().begin(), stream.segments().end(), expected.segments().begin(),
                  expected.segments().end(), same)) {
    check.problems.emplace_back("manifest.json: its list of segments isn't what the index says");
  }
}

Status check_frames(const fs::path& folder, CameraReader& reader, const std::string& camera_id,
                    CameraCheck& check, const Observer& observer) {
  const auto& records = reader.records();
  for (std::size_t first = 0, end = 0; first < records.size(); first = end) {
    end = end_of_segment(records, first);
    std::uint64_t bad = 0;
    std::string reason;
    for (std::size_t i = first; i < end; ++i) {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer,
                                        static_cast<double>(i) / static_cast<double>(records.size()),
                                        "reading back " + camera_id));
      const auto frame = reader.read(i);
      if (frame) continue;
      if (++bad == 1) reason = frame.error().what + " (frame " + std::to_string(i) + ")";
    }
    check.bad += bad;
    check.good += end - first - bad;
    if (bad == 0) continue;
    const fs::path path = find_segment(folder, camera_id, records[first].segment);
    const std::string file = path.empty() ? segment_name(camera_id, records[first].segment, Encoding::ffv1)
                                          : path.lexically_relative(folder).string();
    check.problems.push_back(
        fmt::format("{}: {} can't be read back: {}", file, of(bad, end - first), reason));
  }
  return {};
}

/// Reads the frames that are in the segments but not in the index.
Status check_unindexed(const fs::path& folder, CameraReader& reader, const std::string& camera_id,
                       std::uint64_t lost_to_the_disk, CameraCheck& check, const Observer& observer) {
  const std::size_t frames = reader.records().size();
  for (std::size_t i = 0; i < frames; ++i) {
    EMBERLOCK_RETURN_IF_ERROR(observe(observer, static_cast<double>(i) / static_cast<double>(frames),
                                      "reading what the index of " + camera_id + " lacks"));
    if (reader.read(i).ok()) ++check.unindexed;
  }
  // Frames that a failing disk stored after all are counted as lost to it.
  if (check.unindexed <= lost_to_the_disk) return {};
  check.problems.push_back(fmt::format("{}: lacks {} frames that lie in the segments",
                                       index_path(folder, camera_id).lexically_relative(folder).string(),
                                       check.unindexed));
  return {};
}

Result<CameraCheck> check_camera(const fs::path& folder, const v1::Manifest& manifest,
                                 const v1::CameraStream& stream, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(stream));
  CameraCheck check;
  check.camera_id = stream.camera_id();
  std::vector<IndexRecord> records = check_index(folder, manifest.state(), stream, check);
  if (manifest.state() != v1::Manifest::RECORDING) check_segments(folder, records, stream, check);
  const Search search = check.missing > 0 ? Search::everywhere : Search::behind_the_index;
  std::vector<IndexRecord> lacking;
  if (manifest.state() != v1::Manifest::RECORDING)
    lacking = unindexed_frames(folder, stream.camera_id(), records, search);
  const auto all = static_cast<double>(std::max<std::size_t>(1, records.size() + lacking.size()));
  const double indexed = static_cast<double>(records.size()) / all;
  CameraReader reader(folder, stream.camera_id(), layout, std::move(records));
  EMBERLOCK_RETURN_IF_ERROR(
      check_frames(folder, reader, stream.camera_id(), check, part_of(observer, 0, indexed)));
  CameraReader unindexed(folder, stream.camera_id(), layout, std::move(lacking));
  EMBERLOCK_RETURN_IF_ERROR(check_unindexed(folder, unindexed, stream.camera_id(), stream.counts().disk(),
                                            check, part_of(observer, indexed, 1)));
  if (check.good == 0) check.problems.push_back(stream.camera_id() + ": not one frame of it can be read");
  return check;
}

void check_events(const fs::path& folder, SessionCheck& check) {
  const auto bytes = read_file(events_path(folder));
  if (!bytes) {
    check.problems.push_back("events.binpb: " + bytes.error().what);
    return;
  }
  const ParsedEvents events = parse_events(*bytes);
  check.events = events.events.size();
  if (events.valid_bytes != bytes->size()) {
    check.problems.push_back("events.binpb: damaged from byte " + std::to_string(events.valid_bytes));
  }
}

/// What certificate.json says that isn't so. Error: cancelled.
Status check_certified(const fs::path& folder, const Observer& observer, SessionCheck& check) {
  const auto certified = check_certificate(folder, observer);
  EMBERLOCK_RETURN_IF_ERROR(observe(observer, 1, "compared with its certificate"));
  if (!certified) {
    check.problems.push_back("certificate.json: " + certified.error().what);
    return {};
  }
  if (!*certified) return {};
  const CertifiedSession& session = **certified;
  check.problems.insert(check.problems.end(), session.problems.begin(), session.problems.end());
  if (!session.problems.empty()) return {};
  check.certified_files = static_cast<std::uint64_t>(session.certificate.files_size());
  check.certified_by = session.seal.key;
  return {};
}

/// Nothing that could be repaired.
bool holds_nothing(const SessionCheck& check) {
  return std::all_of(check.cameras.begin(), check.cameras.end(), [](const CameraCheck& c) {
    return c.good == 0 && c.unindexed == 0 && c.bad == 0 && c.missing == 0;
  });
}

}  // namespace

bool SessionCheck::whole() const {
  return (state == v1::Manifest::COMPLETE || state == v1::Manifest::SALVAGED) && problems.empty() &&
         std::all_of(cameras.begin(), cameras.end(), [](const CameraCheck& c) { return c.problems.empty(); });
}

Result<SessionCheck> verify_session(const fs::path& folder, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest manifest, read_manifest(folder));
  SessionCheck check;
  check.state = manifest.state();
  check.cameras.resize(static_cast<std::size_t>(manifest.cameras_size()));
  constexpr double kDecoding = 0.95;  // of the time; hashing is fast beside it
  const Observer decoding = part_of(observer, 0, kDecoding);
  EMBERLOCK_RETURN_IF_ERROR(
      in_parallel(check.cameras.size(), decoding, [&](std::size_t i, const Observer& seen) -> Status {
        EMBERLOCK_ASSIGN_OR_RETURN(
            check.cameras[i], check_camera(folder, manifest, manifest.cameras(static_cast<int>(i)), seen));
        return {};
      }));
  check_events(folder, check);
  check.readable = check.whole();
  EMBERLOCK_RETURN_IF_ERROR(check_certified(folder, part_of(observer, kDecoding, 1), check));
  if (check.state == v1::Manifest::RECORDING) {
    check.problems.emplace_back(
        "manifest.json: the recording isn't finished: its recorder still runs or was killed");
    check.to_do =
        "Wait for its recorder; if that was killed, `emberlock sessions repair` keeps what reached the disk";
  } else if (holds_nothing(check)) {
    check.to_do = "Nothing was recorded, or nothing of it is left: record again";
  } else if (check.readable && !check.whole()) {
    check.to_do =
        "Restore the named files from a copy; if the change was meant, such as a repair, certify the session "
        "anew";
  } else if (!check.whole()) {
    check.to_do = "Restore the named files from a copy, or let `emberlock sessions repair` keep what is good";
  }
  static_cast<void>(observe(observer, 1, "read back"));
  return check;
}

}  // namespace emberlock::session
