// SPDX-License-Identifier: Apache-2.0
#include "films/import_parts.h"

#include <algorithm>
#include <bit>
#include <functional>
#include <iterator>
#include <memory>
#include <span>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include "base/file.h"
#include "base/log.h"
#include "base/output_folder.h"
#include "session/events.h"
#include "session/files.h"
#include "session/index.h"

namespace emberlock::films {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kReadOn = 48;  // frames; for larger distances seeking is faster
/// The text in the lock file of an import's folder, which identifies the folder.
constexpr std::string_view kWorkText = "emberlock import, unfinished\n";

fs::path lock_of(const fs::path& work) { return work / "lock"; }

/// Whether an import made this folder, or it is empty.
Status check_work(const fs::path& work) {
  std::error_code ec;
  const auto text = read_file(lock_of(work));
  const bool alone = std::distance(fs::directory_iterator(work, ec), {}) == (text ? 1 : 0);
  if (!fs::is_symlink(fs::symlink_status(lock_of(work), ec)) &&
      ((text && *text == kWorkText) || (alone && (!text || text->empty())))) {
    return {};
  }
  return Error{ErrorKind::bad_input, "holds files, and none that says that an unfinished import left them",
               work.string(), "Move it away, or name another folder for the session"};
}

bool is_file_or_its_partial(const std::string& name, const fs::path& file) {
  return name == file.filename().string() || name.starts_with("." + file.filename().string() + ".partial.");
}

/// Whether SessionWriter creates a file of this name in a camera's folder.
bool is_of_camera(const std::string& name) {
  const std::size_t digits = std::min(name.find_first_not_of("0123456789"), name.size());
  const std::string rest = name.substr(digits);
  return is_file_or_its_partial(name, session::index_path("", "c")) ||
         (digits >= 6 && (rest == ".mkv" || rest == ".nut"));
}

/// Whether SessionWriter creates a file of this name in the session's folder, for a session with this one
/// camera.
bool is_of_session(const std::string& path, const std::string& camera) {
  if (path.starts_with(camera + "/")) return is_of_camera(path.substr(camera.size() + 1));
  return path == "reserve" || is_file_or_its_partial(path, session::manifest_path("")) ||
         is_file_or_its_partial(path, session::events_path(""));
}

/// Removes an unfinished import's files. Errors: bad_input if other files are among them.
Status remove_part(const fs::path& folder, const std::function<bool(const std::string& path)>& ours) {
  std::error_code ec;
  if (!fs::exists(fs::symlink_status(folder, ec))) return {};
  if (remove_ours(folder, [&](const std::string& path, const struct stat& /*info*/) { return ours(path); }))
    return {};
  return Error{ErrorKind::bad_input, "holds files that no import made", folder.string(),
               "Move them away, and import again"};
}

/// Removes the work folder after the session has its final name.
void remove_work(const fs::path& work) {
  static constexpr std::string_view kPart = "camera-";
  static constexpr std::string_view kMark = ".done";
  std::error_code ec;
  std::vector<std::string> parts;
  for (fs::directory_iterator at(work, ec), end; !ec && at != end; at.increment(ec)) {
    const std::string name = at->path().filename().string();
    if (name.starts_with(kPart) && at->is_directory(ec)) parts.push_back(name.substr(kPart.size()));
  }
  for (const std::string& id : parts) {
    const Status gone = remove_part(work / (std::string(kPart) + id),
                                    [&](const std::string& path) { return is_of_session(path, id); });
    if (!gone.ok()) log(LogCategory::films).warn("{}", gone.error().message());
  }
  const bool all = remove_ours(work, [&](const std::string& path, const struct stat& /*info*/) {
    return path == "lock" ||
           (path.starts_with(kPart) && path.ends_with(kMark) && path.find('/') == std::string::npos);
  });
  if (!all) log(LogCategory::films).warn("{} holds files that no import made: they are kept", work.string());
}

/// Everything that a camera's frames depend on. If it is unchanged, the frames needn't be written again.
std::string fingerprint(const CameraPart& part) {
  std::string text = fmt::format("emberlock import 1\ncolours {} encoding {}\n",
                                 static_cast<int>(part.colours), static_cast<int>(part.writer.encoding));
  for (const session::ClipPart& file : part.files) {
    struct stat info {};
    if (::stat(file.path.c_str(), &info) != 0) info = {};
    text += fmt::format("{} {} bytes {}.{:09}\n", fs::absolute(file.path).string(), info.st_size,
                        info.st_mtim.tv_sec, info.st_mtim.tv_nsec);
  }
  std::vector<std::int64_t> numbers = part.places;
  for (const FrameStamp& stamp : part.stamps) {
    numbers.push_back(static_cast<std::int64_t>(stamp.frame_id));
    numbers.push_back(stamp.device_time.ns);
    numbers.push_back(stamp.system_time.ns);
  }
  return text + fmt::format("{} frames {:016x}\n", part.places.size(),
                            session::pixel_hash(std::as_bytes(std::span<const std::int64_t>(numbers))));
}

Status move(const fs::path& from, const fs::path& to) {
  std::error_code ec;
  fs::rename(from, to, ec);
  if (!ec) return {};
  return Error{ErrorKind::io, "cannot move into place: " + ec.message(), to.string(),
               "Check that the folder is writable"};
}

Status write_frames(const CameraPart& part, session::SessionWriter& writer, const Observer& observer,
                    std::optional<std::int64_t>& damaged_at) {
  session::ClipReader film(part.files, part.colours);
  std::shared_ptr<const Image> image;
  std::int64_t shown = -1;  // index of `image`
  const auto count = static_cast<double>(part.places.size());
  for (std::size_t i = 0; i < part.places.size(); ++i) {
    const std::int64_t place = part.places[i];
    EMBERLOCK_RETURN_IF_ERROR(observe(observer, static_cast<double>(i) / count, part.stream.camera_id()));
    if (place != shown) {
      if (!image || place < film.place() || place > film.place() + kReadOn)
        EMBERLOCK_RETURN_IF_ERROR(film.seek(place));
      while (film.place() <= place) {
        Result<Image> next = film.next();
        if (!next.ok()) {
          damaged_at = film.place();
          return next.error();
        }
        if (film.place() > place) image = std::make_shared<const Image>(std::move(next).value());
      }
      shown = place;
    }
    EMBERLOCK_RETURN_IF_ERROR(writer.write(0, {part.stamps[i], image}));
  }
  return {};
}

/// Writes the frames of one camera as a session.
Status write_part(const CameraPart& part, const fs::path& folder, const Observer& observer,
                  std::optional<std::int64_t>& damaged_at) {
  v1::Manifest manifest;
  *manifest.add_cameras() = part.stream;
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionWriter writer,
                             session::SessionWriter::create(folder, manifest, part.writer));
  EMBERLOCK_RETURN_IF_ERROR(write_frames(part, writer, observer, damaged_at));
  EMBERLOCK_RETURN_IF_ERROR(writer.finish());
  return {};
}

}  // namespace

Result<ImportFolder> ImportFolder::open(const fs::path& session, const std::vector<fs::path>& inputs) {
  EMBERLOCK_RETURN_IF_ERROR(check_new_folder(session));
  EMBERLOCK_RETURN_IF_ERROR(check_apart(session, inputs));
  std::error_code ec;
  fs::path name = fs::weakly_canonical(fs::absolute(session), ec);
  if (name.filename().empty()) name = name.parent_path();
  fs::path work = name;
  work += ".importing";
  EMBERLOCK_ASSIGN_OR_RETURN(MadeFolders made, MadeFolders::create(work));
  EMBERLOCK_RETURN_IF_ERROR(check_work(work));
  UniqueFd lock(::open(lock_of(work).c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0644));
  if (!lock) return session::errno_error(lock_of(work), "cannot create");
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{ErrorKind::refused, "another import into this session is at work", session.string(),
                 "Wait for it, or name another folder"};
  }
  if (fs::file_size(lock_of(work), ec) == 0)
    EMBERLOCK_RETURN_IF_ERROR(session::write_fully(lock.get(), kWorkText, lock_of(work)));
  return ImportFolder(std::move(name), std::move(work), std::move(made), std::move(lock));
}

ImportFolder::~ImportFolder() {
  std::error_code ec;
  if (!lock_ || std::distance(fs::directory_iterator(work_, ec), {}) != 1) return;
  fs::remove(lock_of(work_), ec);
  fs::remove(work_, ec);
}

fs::path ImportFolder::part_folder(const CameraPart& part) const {
  return work_ / ("camera-" + part.stream.camera_id());
}
fs::path ImportFolder::mark_of(const CameraPart& part) const {
  return work_ / ("camera-" + part.stream.camera_id() + ".done");
}

bool ImportFolder::has(const CameraPart& part) const {
  const auto mark = read_file(mark_of(part));
  if (!mark || *mark != fingerprint(part)) return false;
  std::error_code ec;
  const std::string& id = part.stream.camera_id();
  return session::read_manifest(part_folder(part)).ok() &&
         (fs::exists(session::index_path(part_folder(part), id), ec) ||
          fs::exists(session::index_path(work_ / "session", id), ec));
}

Status ImportFolder::write(const CameraPart& part, const Observer& observer,
                           std::optional<std::int64_t>& damaged_at) const {
  if (has(part)) return {};
  const std::string& id = part.stream.camera_id();
  const fs::path folder = part_folder(part);
  std::error_code ec;
  fs::remove(mark_of(part), ec);
  EMBERLOCK_RETURN_IF_ERROR(
      remove_part(folder, [&](const std::string& path) { return is_of_session(path, id); }));
  EMBERLOCK_RETURN_IF_ERROR(remove_part(work_ / "session" / id, is_of_camera));
  if (Status written = write_part(part, folder, observer, damaged_at); !written.ok()) {
    // The next try begins this camera anew.
    static_cast<void>(remove_part(folder, [&](const std::string& path) { return is_of_session(path, id); }));
    return written;
  }
  return write_file_atomically(mark_of(part), fingerprint(part));
}

Result<v1::Manifest> ImportFolder::finish(v1::Manifest manifest, const std::vector<CameraPart>& parts,
                                          const v1::ShutterTimes* times, const ImportReports& reports) const {
  const fs::path folder = work_ / "session";
  std::error_code ec;
  fs::create_directories(folder, ec);
  manifest.clear_cameras();
  for (const CameraPart& part : parts) {
    const std::string& id = part.stream.camera_id();
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest written, session::read_manifest(part_folder(part)));
    v1::CameraStream stream = part.stream;
    *stream.mutable_segments() = written.cameras(0).segments();
    *stream.mutable_counts() = written.cameras(0).counts();
    *manifest.add_cameras() = std::move(stream);
    if (!fs::exists(folder / id, ec)) EMBERLOCK_RETURN_IF_ERROR(move(part_folder(part) / id, folder / id));
  }
  fs::remove(session::events_path(folder), ec);
  {
    EMBERLOCK_ASSIGN_OR_RETURN(
        session::EventLog events,
        session::EventLog::open(session::events_path(folder), session::EventLog::Mode::create));
    EMBERLOCK_RETURN_IF_ERROR(events.sync());
  }
  manifest.set_format_version(session::kSessionFormatVersion);
  manifest.set_state(v1::Manifest::COMPLETE);
  EMBERLOCK_RETURN_IF_ERROR(session::check_manifest(manifest, session::manifest_path(folder).string()));
  fs::remove(session::shutter_times_path(folder), ec);
  if (times != nullptr) EMBERLOCK_RETURN_IF_ERROR(session::write_shutter_times(folder, *times));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "import.json", reports.json));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "import.html", reports.page));
  EMBERLOCK_RETURN_IF_ERROR(session::write_manifest(folder, manifest));
  EMBERLOCK_RETURN_IF_ERROR(move(folder, session_));  // an empty folder of that name is replaced
  EMBERLOCK_RETURN_IF_ERROR(sync_folder(session_.parent_path()));
  remove_work(work_);
  return manifest;
}

}  // namespace emberlock::films
