// SPDX-License-Identifier: Apache-2.0
#include "base/file.h"

#include <cerrno>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>

#include "base/kind_of_file.h"
#include "base/unique_fd.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

Error system_error(const fs::path& path, const std::string& action, std::string remedy = {}) {
  return {ErrorKind::io, action + ": " + std::generic_category().message(errno), path.string(),
          std::move(remedy)};
}

fs::path sibling(const fs::path& target) {
  fs::path clean = target.lexically_normal();
  if (clean.filename().empty()) clean = clean.parent_path();
  return clean.parent_path() / ("." + clean.filename().string() + ".partial." + std::to_string(::getpid()));
}

Status write_all(int fd, std::string_view content, const fs::path& path) {
  while (!content.empty()) {
    const ssize_t n = ::write(fd, content.data(), content.size());
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(path, "cannot write", "Free space or choose another disk");
    content.remove_prefix(static_cast<std::size_t>(n));
  }
  return {};
}

}  // namespace

Result<std::string> read_file(const fs::path& path, std::size_t max_bytes) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd fd, open_regular_file(path));
  struct stat info {};
  if (::fstat(fd.get(), &info) != 0) return system_error(path, "cannot stat");
  if (static_cast<std::size_t>(info.st_size) > max_bytes) {
    return Error{ErrorKind::bad_input, "larger than the " + std::to_string(max_bytes) + " bytes allowed here",
                 path.string(), "Check that this is the file you mean"};
  }
  std::string content(static_cast<std::size_t>(info.st_size), '\0');
  std::size_t filled = 0;
  while (filled < content.size()) {
    const ssize_t n = ::read(fd.get(), content.data() + filled, content.size() - filled);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return system_error(path, "cannot read");
    if (n == 0) break;
    filled += static_cast<std::size_t>(n);
  }
  content.resize(filled);
  return content;
}

Status sync_folder(const fs::path& folder) {
  const UniqueFd fd(::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) return system_error(folder, "cannot open the folder");
  // Some network file systems can't sync a folder, and don't need to.
  if (::fsync(fd.get()) == 0 || errno == EINVAL || errno == ENOTSUP) return {};
  return system_error(folder, "cannot flush the folder", "Check the disk's health");
}

Status write_file_atomically(const fs::path& path, std::string_view content) {
  const fs::path partial = sibling(path);
  {
    const UniqueFd fd(::open(partial.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
    if (!fd) return system_error(path, "cannot create", "Check that the folder exists and is writable");
    if (auto s = write_all(fd.get(), content, path); !s.ok() || ::fsync(fd.get()) != 0) {
      const Error error = s.ok() ? system_error(path, "cannot flush") : s.error();
      ::unlink(partial.c_str());
      return error;
    }
  }
  if (::rename(partial.c_str(), path.c_str()) != 0) {
    const Error error = system_error(path, "cannot rename into place");
    ::unlink(partial.c_str());
    return error;
  }
  return sync_folder(path.parent_path());
}

}  // namespace emberlock
