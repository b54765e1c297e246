#include "session/writer.h"

#include <filesystem>
#include <system_error>
#include <utility>

#include "session/camera_writer.h"
#include "session/events.h"
#include "session/files.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

Status create_folder(const fs::path& folder) {
  std::error_code ec;
  if (fs::exists(folder, ec) && !(fs::is_directory(folder, ec) && fs::is_empty(folder, ec))) {
    return Error{ErrorKind::bad_input, "exists already and is not an empty folder", folder.string(),
                 "Name a new folder for the session"};
  }
  fs::create_directories(folder, ec);
  if (ec) {
    return Error{ErrorKind::io, "cannot create the folder: " + ec.message(), folder.string(),
                 "Check that its parent is writable"};
  }
  return {};
}

Status check_options(const WriterOptions& options) {
  if (options.frames_per_segment >= 1 && options.bytes_per_segment >= 1) return {};
  return Error{ErrorKind::bad_input, "a segment must hold at least one frame and one byte", "session options",
               "Raise frames_per_segment and bytes_per_segment"};
}

}  // namespace

SessionWriter::SessionWriter(fs::path folder, v1::Manifest manifest)
    : folder_(std::move(folder)), manifest_(std::move(manifest)) {}
SessionWriter::SessionWriter(SessionWriter&&) noexcept = default;
SessionWriter& SessionWriter::operator=(SessionWriter&&) noexcept = default;
SessionWriter::~SessionWriter() = default;

Result<SessionWriter> SessionWriter::create(const fs::path& folder, v1::Manifest manifest,
                                            WriterOptions options) {
  EMBERLOCK_RETURN_IF_ERROR(check_options(options));
  manifest.set_format_version(kSessionFormatVersion);
  manifest.set_state(v1::Manifest::RECORDING);
  for (v1::CameraStream& camera : *manifest.mutable_cameras()) {
    camera.clear_segments();
    camera.clear_counts();
  }
  EMBERLOCK_RETURN_IF_ERROR(check_manifest(manifest, manifest_path(folder).string()));
  EMBERLOCK_RETURN_IF_ERROR(create_folder(folder));
  SessionWriter writer(folder, std::move(manifest));
  EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, writer.manifest_));
  EMBERLOCK_RETURN_IF_ERROR(keep_reserve(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(EventLog events, EventLog::open(events_path(folder), EventLog::Mode::create));
  writer.events_ = std::make_unique<EventLog>(std::move(events));
  for (const v1::CameraStream& camera : writer.manifest_.cameras()) {
    EMBERLOCK_ASSIGN_OR_RETURN(auto lane, CameraWriter::create(folder, camera, options));
    writer.cameras_.push_back(std::move(lane));
  }
  return writer;
}

Status SessionWriter::write(std::size_t camera, const Frame& frame) {
  return cameras_.at(camera)->write(frame);
}

void SessionWriter::count_lost(std::size_t camera, LossCause cause, std::uint64_t frames) {
  cameras_.at(camera)->count_lost(cause, frames);
}

WrittenSoFar SessionWriter::written(std::size_t camera) const { return cameras_.at(camera)->written(); }

void SessionWriter::set_arrivals(std::size_t camera, const Arrivals& arrivals) {
  cameras_.at(camera)->set_arrivals(arrivals);
}

Status SessionWriter::append(const v1::Event& event) { return events_->append(event); }

Result<v1::Manifest> SessionWriter::finish() {
  Status first;
  for (int i = 0; i < manifest_.cameras_size(); ++i) {
    const Status done = cameras_[static_cast<std::size_t>(i)]->finish(*manifest_.mutable_cameras(i));
    if (first && !done) first = done;
  }
  if (!first) return first.error();
  EMBERLOCK_RETURN_IF_ERROR(events_->sync());
  manifest_.set_state(v1::Manifest::COMPLETE);
  drop_reserve(folder_);
  EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder_, manifest_));
  return manifest_;
}

}  // namespace emberlock
