// SPDX-License-Identifier: Apache-2.0
#include "base/secret_file.h"

#include <cerrno>
#include <system_error>

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"

namespace emberlock {

Status check_secret_file(const std::filesystem::path& file, std::string_view what) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0)
    return Error{ErrorKind::io, "stat failed: " + std::generic_category().message(errno), file.string()};
  const auto open_to = [&](std::string_view who, std::string_view remedy) {
    return Error{ErrorKind::bad_input, fmt::format("{} {} (mode {:04o})", who, what, status.st_mode & 07777U),
                 file.string(), fmt::format("make it private: chmod {} {}", remedy, file.string())};
  };
  // root checks a service user's files too.
  if (status.st_uid != 0 && status.st_uid != ::geteuid() && ::geteuid() != 0)
    return Error{ErrorKind::bad_input, fmt::format("another user owns {} (uid {})", what, status.st_uid),
                 file.string(),
                 fmt::format("make it root's, or the daemon's user's: chown USER {}", file.string())};
  if ((status.st_mode & S_IRWXO) != 0) return open_to("everybody may read or write", "o=");
  if ((status.st_mode & S_IWGRP) != 0) return open_to("its group may write to", "g-w");
  return {};
}

Result<std::string> read_secret_file(const std::filesystem::path& file, std::size_t max_bytes,
                                     std::string_view what) {
  EMBERLOCK_ASSIGN_OR_RETURN(std::string text, read_file(file, max_bytes));
  EMBERLOCK_RETURN_IF_ERROR(check_secret_file(file, what));
  return text;
}

}  // namespace emberlock
