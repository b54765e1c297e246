// SPDX-License-Identifier: Apache-2.0
#include "base/output_leftovers.h"

#include <cerrno>
#include <chrono>
#include <map>
#include <system_error>
#include <thread>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>

#include "base/log.h"
#include "base/output_folder.h"
#include "base/result_list.h"

namespace emberlock {
namespace fs = std::filesystem;
namespace {

bool same_inode(const fs::path& path, const struct stat& info) {
  struct stat other {};
  return ::lstat(path.c_str(), &other) == 0 && other.st_dev == info.st_dev && other.st_ino == info.st_ino;
}

/// Cleans up after a hidden folder of OutputFolder::create(). It is removed if no process fills it any more
/// and its list says that it wasn't finished.
void clean_up_hidden(const fs::path& folder, const fs::path& target) {
  const auto list = read_result_list(folder);
  if (!list) {  // killed before the list was written
    const std::string partial = "." + std::string(kResultList) + ".partial.";
    remove_ours(folder, [&](const std::string& path, const struct stat& /*info*/) {
      return path.starts_with(partial);
    });
    return;
  }
  const UniqueFd lock = lock_list(folder);
  if (!lock) return;
  std::error_code ec;
  if (list->finished) {
    discard(folder, target);
  } else {
    fs::remove_all(folder, ec);
  }
}

}  // namespace

std::string hidden_prefix(const fs::path& target) { return "." + target.filename().string() + ".emberlock-"; }

fs::path earlier_of(const fs::path& target) {
  fs::path earlier = target;
  earlier += ".emberlock-earlier";
  return earlier;
}

bool is_there(const fs::path& path) {
  std::error_code ec;
  return fs::exists(fs::symlink_status(path, ec));
}

Error refused_by_system(const fs::path& path, const std::string& action, std::string remedy) {
  return {ErrorKind::io, action + ": " + std::generic_category().message(errno), path.string(),
          std::move(remedy)};
}

Result<UniqueFd> lock_folder(const fs::path& folder, Seconds patience) {
  constexpr std::chrono::milliseconds kBetweenTries(20);
  constexpr double kSilent = 1;  // seconds
  UniqueFd fd(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd) return refused_by_system(folder, "cannot open the folder");
  const auto start = std::chrono::steady_clock::now();
  bool said = false;
  while (::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) {
    if (errno == EINTR) continue;
    if (errno != EWOULDBLOCK) return refused_by_system(folder, "cannot lock the folder");
    const std::chrono::duration<double> waited = std::chrono::steady_clock::now() - start;
    if (waited.count() >= patience.value()) {
      return Error{ErrorKind::io,
                   fmt::format("is locked by another program, for {:.3g} s by now", waited.count()),
                   folder.string(), "End the other program (fuser -v names it), or name another folder"};
    }
    if (!said && waited.count() >= kSilent) {
      log(LogCategory::base).warn("waiting for another program that has {} locked", folder.string());
      said = true;
    }
    std::this_thread::sleep_for(kBetweenTries);
  }
  return fd;
}

UniqueFd lock_list(const fs::path& folder) {
  // Opened for writing, because NFS grants an exclusive lock on nothing else.
  UniqueFd fd(::open((folder / kResultList).c_str(), O_RDWR | O_NOFOLLOW | O_CLOEXEC));
  if (fd && ::flock(fd.get(), LOCK_EX | LOCK_NB) != 0) fd = UniqueFd();
  return fd;
}

bool discard(const fs::path& folder, const fs::path& target) {
  const auto list = read_result_list(folder);
  if (!list) return false;
  std::map<std::string, const ListedFile*> listed;
  for (const ListedFile& file : list->files) listed.emplace(file.path, &file);
  remove_ours(folder, [&](const std::string& path, const struct stat& info) {
    const auto known = listed.find(path);
    return (known != listed.end() && is_unchanged(*known->second, folder / path, info)) ||
           same_inode(target / path, info);
  });
  std::error_code ec;
  if (std::distance(fs::directory_iterator(folder, ec), {}) == 1) ::unlink((folder / kResultList).c_str());
  return ::rmdir(folder.c_str()) == 0;
}

Status clean_up(const fs::path& target) {
  const fs::path earlier = earlier_of(target);
  if (const auto list = read_result_list(earlier); list && list->finished) {
    // Back to its name, if that is free or taken only by an empty folder.
    if (::rename(earlier.c_str(), target.c_str()) != 0 && (errno == ENOTEMPTY || errno == EEXIST))
      discard(earlier, target);
  } else {
    ::rmdir(earlier.c_str());  // if it is empty
  }
  const std::string prefix = hidden_prefix(target);
  std::error_code ec;
  std::vector<fs::path> left;
  for (fs::directory_iterator at(target.parent_path(), ec), end; !ec && at != end; at.increment(ec))
    if (at->path().filename().string().starts_with(prefix)) left.push_back(at->path());
  for (const fs::path& folder : left) clean_up_hidden(folder, target);
  if (!is_there(earlier)) return {};
  return Error{ErrorKind::bad_input, "is in the way", earlier.string(), "Move it away, or name a new folder"};
}

}  // namespace emberlock
