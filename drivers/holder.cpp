// SPDX-License-Identifier: Apache-2.0
#include "drivers/holder.h"

#include <fstream>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace emberlock::drivers {
namespace fs = std::filesystem;
namespace {

std::optional<int> pid_of(const fs::path& proc_entry) {
  const std::string name = proc_entry.filename();
  if (name.empty() || name.find_first_not_of("0123456789") != std::string::npos || name.size() > 9) return {};
  return std::stoi(name);
}

/// Whether the descriptor was opened with O_PATH, as udev does while it sets a device's permissions.
bool only_names(const fs::path& process, const fs::path& fd) {
  std::ifstream info(process / "fdinfo" / fd.filename());
  std::string key;
  unsigned flags = 0;
  return info >> key >> key && info >> key >> std::oct >> flags && (flags & O_PATH) != 0;
}

bool has_open(const fs::path& process, const fs::path& file) {
  std::error_code error;
  for (fs::directory_iterator fd(process / "fd", error), end; !error && fd != end; fd.increment(error)) {
    std::error_code gone;
    if (fs::read_symlink(fd->path(), gone) == file && !only_names(process, fd->path())) return true;
  }
  return false;
}

/// Another process with a descriptor to this target, according to /proc.
std::optional<Holder> who_has(const fs::path& file) {
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end;
       process.increment(error)) {
    const auto pid = pid_of(process->path());
    if (!pid || *pid == ::getpid() || !has_open(process->path(), file)) continue;
    Holder holder{*pid, {}};
    std::ifstream comm(process->path() / "comm");
    std::getline(comm, holder.program);
    return holder;
  }
  return {};
}

}  // namespace

std::optional<Holder> holder_of(const fs::path& device) {
  std::error_code error;
  const fs::path file = fs::canonical(device, error);
  return error ? std::nullopt : who_has(file);
}

std::optional<Holder> holder_of_socket(const std::string& inode) { return who_has("socket:[" + inode + "]"); }

Error held_error(const fs::path& device, const std::string& where) {
  const auto holder = holder_of(device);
  if (!holder) return {ErrorKind::device, "another process has it", where, "close the program that uses it"};
  return {ErrorKind::device, holder->program + " (process " + std::to_string(holder->pid) + ") has it", where,
          "close that program, then try again"};
}

}  // namespace emberlock::drivers
