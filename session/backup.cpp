// SPDX-License-Identifier: Apache-2.0
#include "session/backup.h"

#include <algorithm>
#include <cstdio>
#include <iterator>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include "base/file.h"
#include "base/output_folder.h"
#include "base/unique_fd.h"
#include "session/events.h"
#include "session/file_copies.h"
#include "session/files.h"
#include "session/verify.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

constexpr const char* kPartialSuffix = ".partial";
constexpr const char* kReplacedSuffix = ".replaced";
constexpr std::string_view kRemovedPrefix = ".removed-";

/// "NAME" of "sessions/NAME" and of "sessions/NAME/".
fs::path named(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  return whole.has_filename() ? whole : whole.parent_path();
}

/// A copy that a power cut kept from being replaced has its name again.
void take_back_replaced(const fs::path& copy, const fs::path& replaced) {
  std::error_code ec;
  if (!fs::exists(copy, ec) && fs::exists(replaced, ec)) fs::rename(replaced, copy, ec);
}

/// Gives the complete copy its name; an earlier one goes only then.
Status put_in_place(const fs::path& partial, const fs::path& copy, const fs::path& replaced) {
  std::error_code ec;
  if (fs::exists(copy, ec)) {
    fs::remove_all(replaced, ec);
    fs::rename(copy, replaced, ec);
  }
  if (!ec) fs::rename(partial, copy, ec);
  if (ec) return Error{ErrorKind::io, "cannot be renamed: " + ec.message(), partial.string()};
  EMBERLOCK_RETURN_IF_ERROR(sync_folder(copy.parent_path()));
  fs::remove_all(replaced, ec);
  return {};
}

std::uint64_t frames_recorded(const v1::Manifest& manifest) {
  std::uint64_t frames = 0;
  for (const v1::CameraStream& camera : manifest.cameras()) frames += camera.counts().recorded();
  return frames;
}

/// What verify_session() reads.
bool is_read_back(const std::string& path) {
  static constexpr std::string_view kEndings[] = {".mkv", ".nut", ".bin", ".binpb", "manifest.json"};
  return std::any_of(std::begin(kEndings), std::end(kEndings),
                     [&](std::string_view ending) { return std::string_view(path).ends_with(ending); });
}

/// Of two files of one time one must be damaged, and nobody knows which.
Status expect_none_rotted(const fs::path& from, const FolderFiles& wanted, const fs::path& copy) {
  EMBERLOCK_ASSIGN_OR_RETURN(const FolderFiles there, files_in(copy));
  const Observer none;
  CopyTally tally(1, none);
  FileCopier files;
  for (const auto& [path, facts] : wanted.files) {
    const auto found = there.files.find(path);
    if (is_read_back(path) || found == there.files.end() || !times_agree(facts, found->second)) continue;
    const Status same = files.compare(from / path, copy / path, tally);
    if (same) continue;
    if (same.error().kind != ErrorKind::bad_input) return same.error();
    return Error{ErrorKind::refused,
                 same.error().what + ", though both were written at one time: one of them is damaged",
                 same.error().where, "Move the damaged one away"};
  }
  return {};
}

/// A copy that differs from the session stays where it may be the better one, or another session's.
Status expect_may_replace(const fs::path& from, const FolderFiles& wanted, const fs::path& copy,
                          const Error& difference, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest manifest, read_manifest(from));
  if (const auto other = read_manifest(copy)) {
    if (other->session_id() != manifest.session_id() || other->created_utc() != manifest.created_utc())
      return Error{ErrorKind::refused,
                   fmt::format("has the name of another session's copy, which was begun {}, this one {}",
                               other->created_utc(), manifest.created_utc()),
                   from.string(), "Rename one of them, or name another folder of copies"};
    if (const auto [here, there] = std::pair(frames_recorded(manifest), frames_recorded(*other));
        here < there)
      return Error{ErrorKind::refused, fmt::format("has {} frames, its copy {}", here, there), from.string(),
                   "Move the copy away if this is the better one, as after a repair"};
  }
  EMBERLOCK_RETURN_IF_ERROR(expect_none_rotted(from, wanted, copy));
  EMBERLOCK_ASSIGN_OR_RETURN(const SessionCheck check, verify_session(from, observer));
  if (check.readable) return {};
  return Error{ErrorKind::refused, "is damaged, and its copy is another one: " + difference.message(),
               from.string(),
               "`emberlock sessions verify` says of each which is the better one; move the copy away if "
               "that is this one"};
}

/// A file that is the session's own, by a mount of its folder or a hard link, is no copy. Error (refused):
/// the first.
Status expect_apart(const FolderFiles& session, const FolderFiles& there, const fs::path& copy) {
  std::set<std::pair<std::uint64_t, std::uint64_t>> own;
  for (const auto& [path, facts] : session.files) own.insert(facts.device_and_inode);
  for (const auto& [path, facts] : there.files)
    if (own.contains(facts.device_and_inode))
      return Error{ErrorKind::refused, "is the session's own file, by a mount or a hard link, and no copy",
                   (copy / path).string(), "Unmount it, or name another folder of copies"};
  return {};
}

/// All of it is on the disk, whoever copied it there.
Status sync_files(const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(const FolderFiles files, files_in(folder));
  for (const auto& [path, facts] : files.files) {
    EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd fd, open_to_read(folder / path));
    if (::fsync(fd.get()) != 0) return errno_error(folder / path, "cannot be written to the disk");
    (void)::posix_fadvise(fd.get(), 0, 0, POSIX_FADV_DONTNEED);
  }
  for (const fs::path& within : files.folders) EMBERLOCK_RETURN_IF_ERROR(sync_folder(folder / within));
  return sync_folder(folder);
}

}  // namespace

Status compare_copy(const fs::path& folder, const fs::path& copy, Compare compare, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const FolderFiles wanted, files_in(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(const FolderFiles there, files_in(copy));
  EMBERLOCK_RETURN_IF_ERROR(expect_apart(wanted, there, copy));
  for (const auto& [path, facts] : there.files)
    if (!wanted.files.contains(path))
      return Error{ErrorKind::bad_input, "isn't in " + folder.string(), (copy / path).string()};
  for (const auto& [path, facts] : wanted.files) {
    const auto found = there.files.find(path);
    if (found == there.files.end())
      return Error{ErrorKind::bad_input, "isn't in " + copy.string(), (folder / path).string()};
    const bool agrees =
        compare == Compare::times ? times_agree(facts, found->second) : facts.bytes == found->second.bytes;
    if (!agrees)
      return Error{
          ErrorKind::bad_input,
          facts.bytes == found->second.bytes
              ? "is of another time than in " + folder.string()
              : fmt::format("has {} bytes, in {} {}", found->second.bytes, folder.string(), facts.bytes),
          (copy / path).string()};
  }
  if (compare == Compare::times) return {};
  CopyTally tally(wanted.bytes(), observer);
  FileCopier files;
  for (const auto& [path, facts] : wanted.files)
    EMBERLOCK_RETURN_IF_ERROR(files.compare(folder / path, copy / path, tally));
  return {};
}

Result<Backup> back_up_session(const fs::path& folder, const fs::path& backups, Compare compare,
                               const Observer& observer) {
  const fs::path from = named(folder);
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd held, hold_finished(from, Alone::no));
  EMBERLOCK_ASSIGN_OR_RETURN(const FolderFiles wanted, files_in(from));
  const fs::path copy = named(backups) / from.filename();
  EMBERLOCK_RETURN_IF_ERROR(check_apart(copy, {from}));
  const fs::path partial = named(backups) / ("." + from.filename().string() + kPartialSuffix);
  const fs::path replaced = named(backups) / ("." + from.filename().string() + kReplacedSuffix);
  take_back_replaced(copy, replaced);
  Backup backup{Backup::Outcome::copied, wanted.files.size(), wanted.bytes()};
  std::error_code ec;
  if (fs::exists(copy, ec)) {
    const Status same = compare_copy(from, copy, compare, part_of(observer, 0, 0.3));
    if (same) {
      backup.outcome = Backup::Outcome::kept;
      return backup;
    }
    if (same.error().kind != ErrorKind::bad_input) return same.error();
    EMBERLOCK_RETURN_IF_ERROR(
        expect_may_replace(from, wanted, copy, same.error(), part_of(observer, 0.3, 0.6)));
    backup.outcome = Backup::Outcome::renewed;
  }
  fs::create_directories(partial, ec);
  if (ec) return Error{ErrorKind::io, "cannot be created: " + ec.message(), partial.string()};
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd alone, open_to_read(partial));
  if (::flock(alone.get(), LOCK_EX | LOCK_NB) != 0)
    return Error{ErrorKind::refused, "another process makes this copy", partial.string(),
                 "Wait until that has ended"};
  const Observer rest = part_of(observer, backup.outcome == Backup::Outcome::renewed ? 0.6 : 0, 1);
  CopyTally tally(2 * backup.bytes, rest);
  EMBERLOCK_RETURN_IF_ERROR(copy_files(from, wanted, partial, tally));
  EMBERLOCK_RETURN_IF_ERROR(put_in_place(partial, copy, replaced));
  return backup;
}

Status remove_backed_up(const fs::path& folder, const fs::path& backups, const Observer& observer) {
  const fs::path from = named(folder);
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd held, hold_finished(from, Alone::yes));
  const fs::path copy = named(backups) / from.filename();
  EMBERLOCK_RETURN_IF_ERROR(check_apart(copy, {from}));
  std::error_code ec;
  if (!fs::exists(copy, ec))
    return Error{ErrorKind::bad_input, "has no copy in " + backups.string(), from.string(),
                 "`emberlock sessions backup` makes one"};
  EMBERLOCK_RETURN_IF_ERROR(sync_files(copy));
  EMBERLOCK_RETURN_IF_ERROR(compare_copy(from, copy, Compare::bytes, observer));
  const fs::path removed = from.parent_path() / (std::string(kRemovedPrefix) + from.filename().string());
  fs::rename(from, removed, ec);
  if (ec) return Error{ErrorKind::io, "cannot be removed: " + ec.message(), from.string()};
  EMBERLOCK_RETURN_IF_ERROR(sync_folder(from.parent_path()));
  fs::remove_all(removed, ec);
  return {};
}

void finish_removals(const fs::path& sessions) {
  std::error_code ec;
  std::vector<fs::path> left;
  for (fs::directory_iterator at(sessions, ec), end; !ec && at != end; at.increment(ec))
    if (at->path().filename().string().starts_with(kRemovedPrefix)) left.push_back(at->path());
  for (const fs::path& folder : left) fs::remove_all(folder, ec);
}

}  // namespace emberlock::session
