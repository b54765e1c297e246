// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace emberlock {

/// Where emberlockd listens and keeps recordings if its configuration doesn't say.
struct DaemonFolders {
  std::filesystem::path runtime;  ///< of the socket
  std::filesystem::path data;     ///< of sessions/ and exports/

  [[nodiscard]] std::filesystem::path socket() const { return runtime / "emberlockd.sock"; }
  [[nodiscard]] std::filesystem::path sessions() const { return data / "sessions"; }
};

/// Of a daemon that the system runs: /run/emberlock and /var/lib/emberlock.
DaemonFolders system_daemon_folders();

/// What decides about them: who runs the program, and its environment. Variables that aren't set are empty.
struct DaemonSurroundings {
  unsigned user = 0;
  std::string runtime_directory = {},
              state_directory = {};  ///< RUNTIME_DIRECTORY, STATE_DIRECTORY: set by systemd
  std::string xdg_runtime_dir = {}, xdg_data_home = {};
  std::string home = {};

  /// Those of this process.
  static DaemonSurroundings now();
};

/// What systemd gave a service; else for root the system's; else the user's own, by the XDG Base Directory
/// Specification: in XDG_RUNTIME_DIR, /run/user/ID or /tmp/emberlock-ID, and in XDG_DATA_HOME or
/// ~/.local/share. Relative paths in the environment don't count.
DaemonFolders daemon_folders(const DaemonSurroundings& surroundings = DaemonSurroundings::now());

/// The socket that a client asks if it isn't told: the user's own daemon's if it is there and nobody else's,
/// else the system's if that is there, else again the own.
std::filesystem::path usual_socket();

}  // namespace emberlock
