// SPDX-License-Identifier: Apache-2.0
#include "session/writer.h"

#include <filesystem>
#include <string>
#include <system_error>
#include <utility>

#include <unistd.h>

#include "base/file.h"
#include "base/output_folder.h"
#include "session/camera_writer.h"
#include "session/events.h"
#include "session/files.h"
#include "session/name.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

/// Absolute, without a trailing slash: the enclosing folder is its parent_path().
fs::path full_path(const fs::path& folder) {
  fs::path path = fs::absolute(folder);
  return path.has_filename() ? path : path.parent_path();
}

/// A device's text on one line, fit for a manifest.
std::string in_one_line(std::string text) {
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < ' ' || c == '\x7f') c = ' ';
  }
  return text.substr(0, kMaxTextBytes);
}

/// The folder of a session that is being created; removed again unless it is kept. Of its contents only those
/// from ours() on are removed, which no other recorder of the same folder creates.
class NewFolder {
 public:
  explicit NewFolder(fs::path path) : path_(std::move(path)) {}
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;
  ~NewFolder() {
    if (kept_) return;
    std::error_code ec;
    if (ours_) {
      for (const auto& entry : fs::directory_iterator(path_, ec)) fs::remove_all(entry.path(), ec);
    }
    // Of the created parents, those that aren't empty stay.
    for (const fs::path& folder : made_) fs::remove(folder, ec);
  }
  Status create() {
    EMBERLOCK_RETURN_IF_ERROR(check_new_folder(path_));
    std::error_code ec;
    kept_ = false;
    for (fs::path folder = path_; !fs::exists(folder, ec) && folder.has_relative_path();
         folder = folder.parent_path())
      made_.push_back(folder);
    fs::create_directories(path_, ec);
    if (ec)
      return Error{ErrorKind::io, "cannot create the folder: " + ec.message(), path_.string(),
                   "Check that its parent is writable"};
    // A folder is durable once its parent is synced. If the parent may not be read, this folder becomes
    // durable with its first file.
    for (const fs::path& folder : made_) {
      const fs::path parent = folder.parent_path();
      if (::access(parent.c_str(), R_OK) == 0) EMBERLOCK_RETURN_IF_ERROR(sync_folder(parent));
    }
    return {};
  }
  void ours() { ours_ = true; }
  void keep() { kept_ = true; }

 private:
  fs::path path_;
  bool ours_ = false;
  std::vector<fs::path> made_;  ///< innermost first
  bool kept_ = true;            ///< before create() nothing is ours
};

/// A disk that refuses one write may take the next. Both are written from the start again.
template <class Write>
Status try_twice(const Write& write) {
  const Status once = write();
  return once ? once : write();
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

Result<SessionWriter> SessionWriter::create(const fs::path& where, v1::Manifest manifest,
                                            WriterOptions options) {
  const fs::path folder = full_path(where);
  EMBERLOCK_RETURN_IF_ERROR(check_options(options));
  manifest.set_format_version(kSessionFormatVersion);
  manifest.set_state(v1::Manifest::RECORDING);
  for (v1::CameraStream& camera : *manifest.mutable_cameras()) {
    camera.clear_segments();
    camera.clear_counts();
    camera.clear_clock();  // frames that are written bear the session's
    camera.set_model(in_one_line(camera.model()));
  }
  EMBERLOCK_RETURN_IF_ERROR(check_texts(manifest, manifest_path(folder).string()));
  EMBERLOCK_RETURN_IF_ERROR(check_manifest(manifest, manifest_path(folder).string()));
  NewFolder created(folder);
  EMBERLOCK_RETURN_IF_ERROR(created.create());
  SessionWriter writer(folder, std::move(manifest));
  // First: if several recorders start in one folder, only one can create this file.
  EMBERLOCK_ASSIGN_OR_RETURN(EventLog events, EventLog::open(events_path(folder), EventLog::Mode::create));
  created.ours();
  EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, writer.manifest_));
  EMBERLOCK_RETURN_IF_ERROR(keep_reserve(folder));
  writer.events_ = std::make_unique<EventLog>(std::move(events));
  for (const v1::CameraStream& camera : writer.manifest_.cameras()) {
    EMBERLOCK_ASSIGN_OR_RETURN(auto lane, CameraWriter::create(folder, camera, options));
    writer.cameras_.push_back(std::move(lane));
  }
  created.keep();
  return writer;
}

Status SessionWriter::write(std::size_t camera, const Frame& frame) {
  return cameras_.at(camera)->write(frame);
}

void SessionWriter::count_lost(std::size_t camera, LossCause cause, std::uint64_t frames) {
  cameras_.at(camera)->count_lost(cause, frames);
}

Status SessionWriter::flush(std::size_t camera) { return cameras_.at(camera)->flush(); }

Status SessionWriter::sync() {
  Status first = events_->sync();
  for (const auto& camera : cameras_) {
    const Status synced = camera->sync();
    if (first && !synced) first = synced;
  }
  return first;
}

Status SessionWriter::events_failure() const { return events_->failure(); }

std::uint64_t SessionWriter::safe(std::size_t camera) const { return cameras_.at(camera)->safe(); }

CameraProgress SessionWriter::progress(std::size_t camera) const { return cameras_.at(camera)->progress(); }

void SessionWriter::set_arrivals(std::size_t camera, const Arrivals& arrivals) {
  cameras_.at(camera)->set_arrivals(arrivals);
}

Status SessionWriter::append(const v1::Event& event) { return events_->append(event); }

Result<v1::Manifest> SessionWriter::finish(const Progress& progress) {
  Status first;
  for (int i = 0; i < manifest_.cameras_size(); ++i) {
    tell(progress, static_cast<double>(i) / manifest_.cameras_size(), "sees that the disk has all frames");
    const Status done = cameras_[static_cast<std::size_t>(i)]->finish(*manifest_.mutable_cameras(i));
    if (first && !done) first = done;
  }
  if (!first) return first.error();
  EMBERLOCK_RETURN_IF_ERROR(try_twice([this] { return events_->sync(); }));
  manifest_.set_state(v1::Manifest::COMPLETE);
  drop_reserve(folder_);
  EMBERLOCK_RETURN_IF_ERROR(try_twice([this] { return write_manifest(folder_, manifest_); }));
  return manifest_;
}

}  // namespace emberlock::session
