#include "cli/import_parts.h"

#include <bit>
#include <memory>
#include <span>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include "base/file.h"
#include "session/events.h"
#include "session/files.h"
#include "session/index.h"

namespace emberlock::cli {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kReadOn = 48;  // frames: beyond, seeking is faster

/// Everything that a camera's frames depend on; what is written under one text needn't be written again.
std::string fingerprint(const CameraPart& part) {
  std::string text = fmt::format("emberlock import 1\ncolours {} encoding {}\n",
                                 static_cast<int>(part.colours), static_cast<int>(part.writer.encoding));
  for (const ClipPart& file : part.files) {
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
                            pixel_hash(std::as_bytes(std::span<const std::int64_t>(numbers))));
}

Status move(const fs::path& from, const fs::path& to) {
  std::error_code ec;
  fs::rename(from, to, ec);
  if (!ec) return {};
  return Error{ErrorKind::io, "cannot move into place: " + ec.message(), to.string(),
               "Check that the folder is writable"};
}

Status write_frames(const CameraPart& part, SessionWriter& writer, const Observer& observer,
                    std::optional<std::int64_t>& damaged_at) {
  ClipReader film(part.files, part.colours);
  std::shared_ptr<const Image> image;
  std::int64_t shown = -1;  // place of `image`
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

}  // namespace

Result<ImportFolder> ImportFolder::open(const fs::path& session) {
  std::error_code ec;
  if (fs::exists(session, ec) && !(fs::is_directory(session, ec) && fs::is_empty(session, ec))) {
    return Error{ErrorKind::bad_input, "exists already and is not an empty folder", session.string(),
                 "Name a new folder for the session"};
  }
  fs::path name = fs::absolute(session).lexically_normal();
  if (name.filename().empty()) name = name.parent_path();
  fs::path work = name;
  work += ".importing";
  fs::create_directories(work, ec);
  if (ec) {
    return Error{ErrorKind::io, "cannot create the folder: " + ec.message(), work.string(),
                 "Check that its parent is writable"};
  }
  UniqueFd lock(::open((work / "lock").c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644));
  if (!lock) return errno_error(work / "lock", "cannot create");
  if (::flock(lock.get(), LOCK_EX | LOCK_NB) != 0) {
    return Error{ErrorKind::refused, "another import into this session is at work", session.string(),
                 "Wait for it, or name another folder"};
  }
  return ImportFolder(std::move(name), std::move(work), std::move(lock));
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
  return read_manifest(part_folder(part)).ok() && (fs::exists(index_path(part_folder(part), id), ec) ||
                                                   fs::exists(index_path(work_ / "session", id), ec));
}

Status ImportFolder::write(const CameraPart& part, const Observer& observer,
                           std::optional<std::int64_t>& damaged_at) const {
  if (has(part)) return {};
  const fs::path folder = part_folder(part);
  std::error_code ec;
  fs::remove(mark_of(part), ec);
  fs::remove_all(folder, ec);
  fs::remove_all(work_ / "session" / part.stream.camera_id(), ec);
  v1::Manifest manifest;
  *manifest.add_cameras() = part.stream;
  EMBERLOCK_ASSIGN_OR_RETURN(SessionWriter writer, SessionWriter::create(folder, manifest, part.writer));
  EMBERLOCK_RETURN_IF_ERROR(write_frames(part, writer, observer, damaged_at));
  EMBERLOCK_RETURN_IF_ERROR(writer.finish());
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
    EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest written, read_manifest(part_folder(part)));
    v1::CameraStream stream = part.stream;
    *stream.mutable_segments() = written.cameras(0).segments();
    *stream.mutable_counts() = written.cameras(0).counts();
    *manifest.add_cameras() = std::move(stream);
    if (!fs::exists(folder / id, ec)) EMBERLOCK_RETURN_IF_ERROR(move(part_folder(part) / id, folder / id));
  }
  fs::remove(events_path(folder), ec);
  {
    EMBERLOCK_ASSIGN_OR_RETURN(EventLog events, EventLog::open(events_path(folder), EventLog::Mode::create));
    EMBERLOCK_RETURN_IF_ERROR(events.sync());
  }
  manifest.set_format_version(kSessionFormatVersion);
  manifest.set_state(v1::Manifest::COMPLETE);
  EMBERLOCK_RETURN_IF_ERROR(check_manifest(manifest, manifest_path(folder).string()));
  fs::remove(shutter_times_path(folder), ec);
  if (times != nullptr) EMBERLOCK_RETURN_IF_ERROR(write_shutter_times(folder, *times));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "import.json", reports.json));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "import.html", reports.page));
  EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  fs::remove(session_, ec);  // an empty folder of this name
  EMBERLOCK_RETURN_IF_ERROR(move(folder, session_));
  fs::remove_all(work_, ec);
  return manifest;
}

}  // namespace emberlock::cli
