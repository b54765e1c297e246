// SPDX-License-Identifier: Apache-2.0
#include "session/events.h"

#include <cerrno>
#include <limits>
#include <sstream>
#include <utility>

#include <fcntl.h>
#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <sys/file.h>
#include <unistd.h>

#include "base/kind_of_file.h"
#include "session/files.h"

namespace emberlock::session {

ParsedEvents parse_events(std::string_view bytes) {
  ParsedEvents parsed;
  for (;;) {
    const std::string_view rest = bytes.substr(parsed.valid_bytes);
    const auto size = static_cast<int>(std::min<std::size_t>(rest.size(), std::numeric_limits<int>::max()));
    google::protobuf::io::CodedInputStream in(reinterpret_cast<const std::uint8_t*>(rest.data()), size);
    std::uint32_t length = 0;
    if (!in.ReadVarint32(&length)) return parsed;
    const auto prefix = static_cast<std::size_t>(in.CurrentPosition());
    if (length > rest.size() - prefix) return parsed;
    v1::Event event;
    if (!event.ParseFromArray(rest.data() + prefix, static_cast<int>(length))) return parsed;
    parsed.events.push_back(std::move(event));
    parsed.valid_bytes += prefix + length;
  }
}

std::string encode(const v1::Event& event) {
  std::ostringstream out;
  google::protobuf::util::SerializeDelimitedToOstream(event, &out);
  return std::move(out).str();
}

Result<UniqueFd> hold_finished(const std::filesystem::path& folder, Alone alone) {
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest manifest, read_manifest(folder));
  // NFS locks for one alone only what is open for writing.
  const int access = alone == Alone::yes ? O_RDWR : O_RDONLY;
  const int operation = alone == Alone::yes ? LOCK_EX : LOCK_SH;
  if (std::error_code ec; std::filesystem::exists(events_path(folder), ec))
    EMBERLOCK_RETURN_IF_ERROR(check_regular_file(events_path(folder)));
  UniqueFd events(::open(events_path(folder).c_str(), access | O_CLOEXEC | O_NONBLOCK));
  if (!events && errno != ENOENT) return errno_error(events_path(folder), "cannot open");
  const bool writing = events && ::flock(events.get(), operation | LOCK_NB) != 0;
  if (writing && errno != EWOULDBLOCK) return errno_error(events_path(folder), "cannot lock");
  if (writing)
    return Error{ErrorKind::refused, "another process writes it", folder.string(),
                 "Wait until that has ended"};
  if (manifest.state() == v1::Manifest::RECORDING)
    return Error{ErrorKind::refused, "its recording didn't end", folder.string(),
                 "`emberlock sessions repair` ends it"};
  return events;
}

Result<EventLog> EventLog::open(const std::filesystem::path& path, Mode mode) {
  const int flags =
      O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NONBLOCK | (mode == Mode::create ? O_EXCL : 0);
  UniqueFd fd(::open(path.c_str(), flags, 0644));
  if (!fd) return errno_error(path, "cannot open for writing");
  if (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno != EWOULDBLOCK) return errno_error(path, "cannot lock");
    return Error{ErrorKind::refused, "the session is still being written by another process", path.string(),
                 "Stop that recorder, or wait for it"};
  }
  EventLog log(std::move(fd), path);
  log.disk_->synced = ::lseek(log.fd_.get(), 0, SEEK_END);
  return log;
}

Status EventLog::write_again() const {
  if (::ftruncate(fd_.get(), disk_->synced) != 0) return errno_error(path_, "cannot cut off a torn event");
  EMBERLOCK_RETURN_IF_ERROR(write_fully(fd_.get(), disk_->unsynced, path_));
  disk_->torn = false;
  return {};
}

Status EventLog::append(const v1::Event& event) {
  const std::string bytes = encode(event);
  const std::scoped_lock lock(disk_->mutex);
  disk_->unsynced += bytes;
  disk_->behind = true;
  if (!disk_->torn && write_fully(fd_.get(), bytes, path_)) return {};
  // A partial event would make all later ones unreadable.
  disk_->torn = true;
  return write_again();
}

Status EventLog::sync() {
  const std::scoped_lock one_at_a_time(disk_->syncing);
  std::size_t bytes = 0;
  {
    const std::scoped_lock lock(disk_->mutex);
    if (!disk_->behind) return disk_->failure;
    if (disk_->torn) disk_->failure = write_again();
    if (disk_->torn) return disk_->failure;
    bytes = disk_->unsynced.size();
    disk_->behind = false;
  }
  const bool synced = ::fdatasync(fd_.get()) == 0;
  Status done = synced ? Status{} : Status(errno_error(path_, "cannot flush"));
  const std::scoped_lock lock(disk_->mutex);
  disk_->failure = done;
  if (!done) {
    disk_->torn = disk_->behind = true;
    return done;
  }
  disk_->synced += static_cast<off_t>(bytes);
  disk_->unsynced.erase(0, bytes);
  return done;
}

Status EventLog::failure() const {
  const std::scoped_lock lock(disk_->mutex);
  return disk_->failure;
}

}  // namespace emberlock::session
