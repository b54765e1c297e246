// SPDX-License-Identifier: Apache-2.0
#include "session/reader.h"

#include <system_error>
#include <utility>

#include "base/file.h"
#include "session/camera_reader.h"
#include "session/events.h"
#include "session/files.h"
#include "session/host_clock.h"
#include "session/layout.h"

namespace emberlock::session {
namespace fs = std::filesystem;

SessionReader::SessionReader(fs::path folder, v1::Manifest manifest)
    : folder_(std::move(folder)), manifest_(std::move(manifest)) {}
SessionReader::SessionReader(SessionReader&&) noexcept = default;
SessionReader& SessionReader::operator=(SessionReader&&) noexcept = default;
SessionReader::~SessionReader() = default;

bool SessionReader::is_session(const fs::path& folder) {
  std::error_code ec;
  return fs::is_regular_file(manifest_path(folder), ec);
}

Result<SessionReader> SessionReader::open(const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  if (manifest.state() != v1::Manifest::COMPLETE && manifest.state() != v1::Manifest::SALVAGED) {
    return Error{ErrorKind::bad_input, "the recording isn't finished: its recorder still runs or was killed",
                 folder.string(), "Wait for it, or salvage the session"};
  }
  SessionReader reader(folder, std::move(manifest));
  for (const v1::CameraStream& camera : reader.manifest_.cameras()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(camera));
    EMBERLOCK_ASSIGN_OR_RETURN(const HostClock clock, clock_of(camera, manifest_path(folder).string()));
    EMBERLOCK_ASSIGN_OR_RETURN(ParsedIndex index, read_index(folder, camera.camera_id()));
    if (!index.whole() || index.records.size() != camera.counts().recorded()) {
      return Error{ErrorKind::bad_input,
                   "the index is damaged: " + std::to_string(index.records.size()) + " good frames of " +
                       std::to_string(camera.counts().recorded()),
                   index_path(folder, camera.camera_id()).string(),
                   "Salvage the session, or restore the file"};
    }
    reader.cameras_.push_back(
        std::make_unique<CameraReader>(folder, camera.camera_id(), layout, std::move(index.records), clock));
  }
  const fs::path path = events_path(folder);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_file(path));
  ParsedEvents events = parse_events(bytes);
  if (events.valid_bytes != bytes.size()) {
    return Error{ErrorKind::bad_input,
                 "the events are damaged from byte " + std::to_string(events.valid_bytes), path.string(),
                 "Salvage the session, or restore the file"};
  }
  reader.events_ = std::move(events.events);
  return reader;
}

Result<SessionReader> SessionReader::follow(const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  SessionReader reader(folder, std::move(manifest));
  reader.grows_ = true;
  for (const v1::CameraStream& camera : reader.manifest_.cameras()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const ImageLayout layout, layout_of(camera));
    EMBERLOCK_ASSIGN_OR_RETURN(const HostClock clock, clock_of(camera, manifest_path(folder).string()));
    reader.cameras_.push_back(std::make_unique<CameraReader>(folder, camera.camera_id(), layout,
                                                             std::vector<IndexRecord>(), clock));
  }
  return reader;
}

Status SessionReader::advance(const std::vector<std::uint64_t>& safe) {
  if (!grows_ || safe.size() != cameras_.size())
    return Error{ErrorKind::bad_input,
                 "it is told of " + std::to_string(safe.size()) + " cameras, and follows " +
                     std::to_string(grows_ ? cameras_.size() : 0),
                 folder_.string()};
  for (std::size_t i = 0; i < safe.size(); ++i) EMBERLOCK_RETURN_IF_ERROR(cameras_[i]->grow_to(safe[i]));
  return {};
}

const ImageLayout& SessionReader::layout(std::size_t camera) const { return cameras_.at(camera)->layout(); }

const std::vector<FrameStamp>& SessionReader::stamps(std::size_t camera) const {
  return cameras_.at(camera)->stamps();
}

Result<Frame> SessionReader::read(std::size_t camera, std::size_t i) {
  CameraReader& reader = *cameras_.at(camera);
  Result<Frame> frame = reader.read(i);
  if (frame || !grows_ || i >= reader.stamps().size()) return frame;
  // What was read ahead may end where the file ended then.
  reader.close_segment();
  frame = reader.read(i);
  if (!frame) reader.close_segment();
  return frame;
}

}  // namespace emberlock::session
