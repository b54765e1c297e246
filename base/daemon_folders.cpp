// SPDX-License-Identifier: Apache-2.0
#include "base/daemon_folders.h"

#include <cerrno>
#include <cstdlib>
#include <system_error>

#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

namespace emberlock {
namespace {
namespace fs = std::filesystem;

std::string variable(const char* name) {
  const char* const value = std::getenv(name);  // NOLINT(concurrency-mt-unsafe): nothing of ours changes it
  return value == nullptr ? std::string() : std::string(value);
}

/// systemd separates several by colons; the first is ours.
fs::path first_of(const std::string& folders) { return folders.substr(0, folders.find(':')); }

/// Whoever else owns the folder could have put any socket there.
bool is_safe(const fs::path& folder, unsigned user) {
  struct stat found {};
  if (::lstat(folder.c_str(), &found) != 0) return errno == ENOENT;
  return S_ISDIR(found.st_mode) && found.st_uid == user;
}

/// Also where its folder may not be looked into.
bool may_be_there(const fs::path& socket) {
  struct stat found {};
  return ::lstat(socket.c_str(), &found) == 0 || errno == EACCES;
}

fs::path own_runtime(const DaemonSurroundings& s) {
  const fs::path named = s.xdg_runtime_dir;
  if (named.is_absolute()) return named / "emberlock";
  const std::string user = std::to_string(s.user);
  std::error_code ignored;
  const fs::path usual = fs::path("/run/user") / user;
  return fs::is_directory(usual, ignored) ? usual / "emberlock" : fs::path("/tmp") / ("emberlock-" + user);
}

fs::path own_data(const DaemonSurroundings& s) {
  const fs::path named = s.xdg_data_home;
  if (named.is_absolute()) return named / "emberlock";
  const fs::path home = s.home;
  if (home.is_absolute()) return home / ".local/share/emberlock";
  return fs::path("/var/tmp") / ("emberlock-" + std::to_string(s.user));
}

}  // namespace

DaemonFolders system_daemon_folders() { return {"/run/emberlock", "/var/lib/emberlock"}; }

DaemonSurroundings DaemonSurroundings::now() {
  DaemonSurroundings s;
  s.user = ::geteuid();
  s.runtime_directory = variable("RUNTIME_DIRECTORY");
  s.state_directory = variable("STATE_DIRECTORY");
  s.xdg_runtime_dir = variable("XDG_RUNTIME_DIR");
  s.xdg_data_home = variable("XDG_DATA_HOME");
  s.home = variable("HOME");
  if (s.home.empty()) {
    const passwd* const user = ::getpwuid(s.user);  // NOLINT(concurrency-mt-unsafe): at the start
    if (user != nullptr) s.home = user->pw_dir;
  }
  return s;
}

DaemonFolders daemon_folders(const DaemonSurroundings& s) {
  DaemonFolders folders = s.user == 0 ? system_daemon_folders() : DaemonFolders{own_runtime(s), own_data(s)};
  if (const fs::path given = first_of(s.runtime_directory); given.is_absolute()) folders.runtime = given;
  if (const fs::path given = first_of(s.state_directory); given.is_absolute()) folders.data = given;
  return folders;
}

fs::path usual_socket() {
  const DaemonSurroundings here = DaemonSurroundings::now();
  const DaemonFolders own = daemon_folders(here);
  fs::path systems = system_daemon_folders().socket();
  if (!is_safe(own.runtime, here.user)) return systems;
  return may_be_there(own.socket()) || !may_be_there(systems) ? own.socket() : systems;
}

}  // namespace emberlock
