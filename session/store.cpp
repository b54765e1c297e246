// SPDX-License-Identifier: Apache-2.0
#include "session/store.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include "base/file.h"
#include "base/utc.h"
#include "session/files.h"
#include "session/index.h"
#include "session/name.h"
#include "session/reader.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

/// For an unfinished recording, whose frames are counted in its index, not in its manifest.
std::uint64_t frames_in_index(const fs::path& folder, const std::string& camera_id) {
  std::error_code ec;
  const std::uintmax_t size = fs::file_size(index_path(folder, camera_id), ec);
  return ec || size < kIndexHeaderBytes ? 0 : (size - kIndexHeaderBytes) / kIndexRecordBytes;
}

bool is_calibrated(const v1::Manifest& manifest) {
  const auto known = [](const v1::CameraStream& camera) {
    return camera.calibration().fx() > 0 && camera.calibration().camera_from_world_size() == 12;
  };
  return manifest.has_box() && manifest.cameras_size() > 0 &&
         std::all_of(manifest.cameras().begin(), manifest.cameras().end(), known);
}

v1::ListSessionsResponse::Entry entry_of(const fs::path& folder) {
  v1::ListSessionsResponse::Entry entry;
  entry.set_session(folder.filename().string());
  entry.set_bytes(bytes_below(folder));
  const auto manifest = read_manifest(folder);
  if (!manifest) {
    entry.set_error(manifest.error().message());
    return entry;
  }
  entry.set_state(manifest->state());
  entry.set_purpose(manifest->purpose());
  entry.set_created_utc(manifest->created_utc());
  entry.set_cameras(static_cast<std::uint32_t>(manifest->cameras_size()));
  entry.set_calibrated(is_calibrated(*manifest));
  const auto& hosts = manifest->hosts();
  entry.set_hosts(static_cast<std::uint32_t>(hosts.size()));
  entry.set_hosts_wanting(
      static_cast<std::uint32_t>(std::count_if(hosts.begin(), hosts.end(), [](const v1::HostPart& part) {
        return part.state() != v1::HostPart::WHOLE;
      })));
  entry.set_led_by(manifest->led_by());
  for (const v1::CameraStream& camera : manifest->cameras()) {
    const v1::Counts& c = camera.counts();
    const bool finished = manifest->state() != v1::Manifest::RECORDING;
    entry.set_frames(entry.frames() +
                     (finished ? c.recorded() : frames_in_index(folder, camera.camera_id())));
    entry.set_lost(entry.lost() + c.camera_gap() + c.transport() + c.underrun() + c.queue() + c.disk());
  }
  return entry;
}

/// Whether a folder that came from elsewhere has this name with its marks apart.
bool looks_taken(const fs::path& folder, const std::string& stored) {
  std::error_code ec;
  for (fs::directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec))
    if (stored_name(at->path().filename().string()) == stored) return true;
  return false;
}

/// The disk of a folder, or of the closest one above it that exists: a folder that was removed is made there
/// again.
std::optional<DiskId> disk_of(fs::path folder) {
  std::error_code unknown;
  while (!fs::exists(folder, unknown) && folder.has_relative_path()) folder = folder.parent_path();
  if (folder.empty()) folder = ".";
  struct stat info {};
  struct statvfs file_system {};
  if (::stat(folder.c_str(), &info) != 0 || ::statvfs(folder.c_str(), &file_system) != 0) return std::nullopt;
  return DiskId{file_system.f_fsid, info.st_dev};
}

std::string name_of_time(TimePoint wall_clock) {
  std::string text = utc_text(wall_clock).substr(0, 19);  // "2026-11-22T02:50:00"
  std::replace(text.begin(), text.end(), ':', '-');
  return text.replace(text.find('T'), 1, " ");
}

}  // namespace

std::uint64_t bytes_below(const fs::path& folder) {
  std::uint64_t bytes = 0;
  std::error_code ec;
  for (fs::recursive_directory_iterator at(folder, fs::directory_options::skip_permission_denied, ec), end;
       !ec && at != end; at.increment(ec)) {
    std::error_code unknown;
    const std::uintmax_t size = at->is_regular_file(unknown) ? at->file_size(unknown) : 0;
    if (!unknown) bytes += size;
  }
  return bytes;
}

std::vector<fs::path> sessions_in(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code ec;
  for (fs::directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec)) {
    const std::string name = at->path().filename().string();
    if ((is_folder_name(name) || check_session_name(name)) && SessionReader::is_session(at->path()))
      found.push_back(at->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

Result<SessionStore> SessionStore::open(fs::path folder, StoreOptions options) {
  if (!folder.has_filename()) folder = folder.parent_path();  // a trailing slash
  std::error_code ec;
  fs::create_directories(folder, ec);
  if (ec || ::access(folder.c_str(), W_OK | X_OK) != 0) {
    const std::string reason = ec ? ec.message() : std::generic_category().message(errno);
    return Error{ErrorKind::io, "recordings can't be written here: " + reason, folder.string(),
                 "Name another folder, or make it writable"};
  }
  const std::optional<DiskId> disk = disk_of(folder);
  if (!disk) return errno_error(folder, "cannot ask for its disk");
  return SessionStore(std::move(folder), options, *disk);
}

Status SessionStore::check_disk() const {
  const std::optional<DiskId> disk = disk_of(folder_);
  if (disk && *disk == disk_) return {};
  return Error{ErrorKind::refused,
               "this folder lies on another disk than at the start: the disk of the recordings isn't mounted",
               folder_.string(), "Mount that disk again, or restart to record to this one"};
}

v1::ListSessionsResponse SessionStore::list() const {
  v1::ListSessionsResponse response;
  for (const fs::path& folder : sessions_in(folder_)) *response.add_sessions() = entry_of(folder);
  std::stable_sort(response.mutable_sessions()->begin(), response.mutable_sessions()->end(),
                   [](const auto& a, const auto& b) { return a.created_utc() > b.created_utc(); });
  return response;
}

Result<fs::path> SessionStore::path_of(std::string_view name) const {
  EMBERLOCK_RETURN_IF_ERROR(check_session_name(name));
  fs::path path = folder_ / name;
  if (!SessionReader::is_session(path)) {
    return Error{ErrorKind::bad_input, "there is no such session", path.string(),
                 "`emberlock sessions list` has them"};
  }
  return path;
}

Result<fs::path> SessionStore::path_for_new(std::string_view name, TimePoint wall_clock) const {
  EMBERLOCK_RETURN_IF_ERROR(check_disk());
  std::error_code ec;
  if (!name.empty()) {
    EMBERLOCK_RETURN_IF_ERROR(check_session_name(name));
    fs::path path = folder_ / stored_name(name);
    if (!fs::exists(fs::symlink_status(path, ec)) && !looks_taken(folder_, path.filename().string()))
      return path;
    return Error{ErrorKind::bad_input, "there is a session of this name", path.string(),
                 "Choose another name"};
  }
  const std::string by_time = name_of_time(wall_clock);
  fs::path path = folder_ / by_time;
  for (int i = 2; fs::exists(fs::symlink_status(path, ec)); ++i)
    path = folder_ / fmt::format("{} {}", by_time, i);
  return path;
}

Result<fs::path> SessionStore::path_for_export(std::string_view name, std::string_view what) const {
  EMBERLOCK_RETURN_IF_ERROR(check_session_name(name));
  EMBERLOCK_RETURN_IF_ERROR(check_disk());
  fs::path path = folder_.parent_path();
  for (const std::string_view part : {std::string_view("exports"), name, what}) {
    path /= part;
    std::error_code ec;
    if (!fs::is_symlink(fs::symlink_status(path, ec))) continue;
    return Error{ErrorKind::bad_input, "is a symbolic link, and exports follow none", path.string(),
                 "Remove it; to have exports on another disk, mount that there"};
  }
  return path;
}

Result<v1::StorageStatus> SessionStore::storage(double bytes_per_s) const {
  EMBERLOCK_RETURN_IF_ERROR(check_disk());
  std::error_code ec;
  const fs::space_info space = fs::space(folder_, ec);
  if (ec) return Error{ErrorKind::io, "cannot ask for free space: " + ec.message(), folder_.string()};
  v1::StorageStatus status;
  status.set_folder(folder_.string());
  status.set_free_bytes(space.available);
  status.set_floor_bytes(options_.min_free_bytes);
  status.set_bytes_per_s(bytes_per_s);
  const std::uint64_t usable =
      space.available - std::min<std::uint64_t>(space.available, options_.min_free_bytes);
  if (bytes_per_s > 0) status.set_minutes_left(static_cast<double>(usable) / bytes_per_s / 60);
  return status;
}

std::vector<fs::path> SessionStore::unfinished() const {
  std::vector<fs::path> found;
  for (const fs::path& folder : sessions_in(folder_)) {
    // Most sessions are finished; the text shows that before the manifest is parsed.
    const auto text = read_file(manifest_path(folder));
    const std::string& word = v1::Manifest::State_Name(v1::Manifest::RECORDING);
    if (!text || text->find(word) == std::string::npos) continue;
    const auto manifest = read_manifest(folder);
    if (manifest.ok() && manifest->state() == v1::Manifest::RECORDING) found.push_back(folder);
  }
  return found;
}

std::vector<fs::path> SessionStore::finished() const {
  std::vector<fs::path> found;
  for (const fs::path& folder : sessions_in(folder_)) {
    const auto manifest = read_manifest(folder);
    if (manifest.ok() && manifest->state() != v1::Manifest::RECORDING) found.push_back(folder);
  }
  return found;
}

}  // namespace emberlock::session
