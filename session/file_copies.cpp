// SPDX-License-Identifier: Apache-2.0
#include "session/file_copies.h"

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <system_error>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "session/files.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

std::int64_t ns_of(const timespec& time) { return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec; }

/// By how much the file system of a copy may have rounded its time: whole steps of 2 s (FAT), 10 ms (exFAT),
/// 100 ns (NTFS).
std::int64_t rounding_of(std::int64_t copied) {
  if (copied % 1'000'000'000 == 0) return 2'000'000'000;
  return copied % 10'000'000 == 0 ? 10'000'000 : 100;
}

/// Reads until `buffer` is full or the file ends.
Result<std::string_view> read_next(const UniqueFd& fd, std::string& buffer, const fs::path& path) {
  std::size_t filled = 0;
  while (filled < buffer.size()) {
    const ssize_t n = ::read(fd.get(), buffer.data() + filled, buffer.size() - filled);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno_error(path, "cannot read");
    if (n == 0) break;
    filled += static_cast<std::size_t>(n);
  }
  return std::string_view(buffer).substr(0, filled);
}

}  // namespace

std::uint64_t FolderFiles::bytes() const {
  std::uint64_t sum = 0;
  for (const auto& [path, facts] : files) sum += facts.bytes;
  return sum;
}

Result<FolderFiles> files_in(const fs::path& folder) {
  FolderFiles found;
  std::error_code ec;
  for (fs::recursive_directory_iterator at(folder, ec), end; !ec && at != end; at.increment(ec)) {
    struct stat info {};
    if (::lstat(at->path().c_str(), &info) != 0) return errno_error(at->path(), "cannot be looked at");
    const fs::path within = at->path().lexically_relative(folder);
    if (S_ISDIR(info.st_mode)) {
      found.folders.push_back(within);
    } else if (S_ISREG(info.st_mode)) {
      found.files[within.string()] = {
          static_cast<std::uint64_t>(info.st_size), info.st_mtim, {info.st_dev, info.st_ino}};
    } else {
      return Error{ErrorKind::bad_input, "is neither a file nor a folder, and a session holds only those",
                   at->path().string(), "Move it away; of a link, put in its place what it leads to"};
    }
  }
  if (ec) return Error{ErrorKind::io, "cannot be listed: " + ec.message(), folder.string()};
  return found;
}

bool times_agree(const FileFacts& file, const FileFacts& copy) {
  const std::int64_t copied = ns_of(copy.modified);
  return file.bytes == copy.bytes && std::abs(ns_of(file.modified) - copied) < rounding_of(copied);
}

Result<UniqueFd> open_to_read(const fs::path& path) {
  UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
  if (!fd) return errno_error(path, "cannot open");
  return fd;
}

CopyTally::CopyTally(std::uint64_t all, const Observer& observer)
    : all_(std::max<std::uint64_t>(all, 1)), observer_(observer) {}

Status CopyTally::add(std::uint64_t bytes, std::string_view what) {
  done_ += bytes;
  return observe(observer_, std::min(kNearlyDone, static_cast<double>(done_) / static_cast<double>(all_)),
                 what);
}

Status FileCopier::copy(const fs::path& from, const fs::path& to, const FileFacts& facts, CopyTally& tally) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd in, open_to_read(from));
  const UniqueFd out(::open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0644));
  if (!out) return errno_error(to, "cannot open for writing");
  for (;;) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string_view part, read_next(in, one_, from));
    if (part.empty()) break;
    EMBERLOCK_RETURN_IF_ERROR(write_fully(out.get(), part, to));
    EMBERLOCK_RETURN_IF_ERROR(tally.add(part.size(), from.filename().string()));
  }
  if (::fsync(out.get()) != 0) return errno_error(to, "cannot be written to the disk");
  // So that it is the disk that is read back.
  (void)::posix_fadvise(out.get(), 0, 0, POSIX_FADV_DONTNEED);
  EMBERLOCK_RETURN_IF_ERROR(compare(from, to, tally));
  // Its time says that it is whole: last.
  const timespec times[2] = {facts.modified, facts.modified};
  if (::futimens(out.get(), times) != 0) return errno_error(to, "cannot be given its time");
  return {};
}

Status FileCopier::compare(const fs::path& from, const fs::path& to, CopyTally& tally) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd a, open_to_read(from));
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd b, open_to_read(to));
  for (std::uint64_t at = 0;;) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string_view left, read_next(a, one_, from));
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string_view right, read_next(b, other_, to));
    if (left != right) {
      const auto same = static_cast<std::uint64_t>(
          std::mismatch(left.begin(), left.end(), right.begin(), right.end()).first - left.begin());
      return Error{ErrorKind::bad_input, fmt::format("differs from {} at byte {}", from.string(), at + same),
                   to.string()};
    }
    if (left.empty()) return {};
    at += left.size();
    EMBERLOCK_RETURN_IF_ERROR(tally.add(left.size(), from.filename().string()));
  }
}

Status copy_files(const fs::path& from, const FolderFiles& wanted, const fs::path& to, CopyTally& tally) {
  std::error_code ec;
  for (const fs::path& folder : wanted.folders) {
    fs::create_directory(to / folder, ec);
    if (ec) return Error{ErrorKind::io, "cannot be created: " + ec.message(), (to / folder).string()};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const FolderFiles there, files_in(to));
  for (const auto& [path, facts] : there.files)
    if (!wanted.files.contains(path)) fs::remove(to / path, ec);
  FileCopier copier;
  for (const auto& [path, facts] : wanted.files) {
    const auto earlier = there.files.find(path);
    if (earlier != there.files.end() && times_agree(facts, earlier->second)) {
      EMBERLOCK_RETURN_IF_ERROR(tally.add(2 * facts.bytes, path));
      continue;
    }
    EMBERLOCK_RETURN_IF_ERROR(copier.copy(from / path, to / path, facts, tally));
  }
  for (const fs::path& folder : wanted.folders) EMBERLOCK_RETURN_IF_ERROR(sync_folder(to / folder));
  return sync_folder(to);
}

}  // namespace emberlock::session
