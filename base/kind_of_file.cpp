// SPDX-License-Identifier: Apache-2.0
#include "base/kind_of_file.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>

namespace emberlock {
namespace fs = std::filesystem;
namespace {

Error cannot_open(const fs::path& path) {
  return {ErrorKind::bad_input, "cannot open: " + std::generic_category().message(errno), path.string(),
          "Check the path and its permissions"};
}

Error not_regular(const fs::path& path) {
  return {ErrorKind::bad_input, "not a regular file", path.string(), "Name a file"};
}

}  // namespace

Status check_regular_file(const fs::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return cannot_open(path);
  return S_ISREG(info.st_mode) ? Status() : Status(not_regular(path));
}

Result<UniqueFd> open_regular_file(const fs::path& path) {
  EMBERLOCK_RETURN_IF_ERROR(check_regular_file(path));
  // The path may lead to a pipe by now: without O_NONBLOCK, opening that waits for a writer.
  UniqueFd fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK));
  if (!fd) return cannot_open(path);
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) return cannot_open(path);
  if (!S_ISREG(info.st_mode)) return not_regular(path);
  return fd;
}

std::string lower_extension(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return extension;
}

}  // namespace emberlock
