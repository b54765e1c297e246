// SPDX-License-Identifier: Apache-2.0
#include "base/daemon_folders.h"

#include <gtest/gtest.h>

namespace emberlock {
namespace {

/// A user whom no machine has, so that /run/user has no folder of theirs.
constexpr unsigned kNobodysId = 3999999999;

TEST(DaemonFolders, RootsAreTheSystems) {
  const DaemonFolders folders = daemon_folders(
      {.user = 0, .xdg_runtime_dir = "/run/user/0", .xdg_data_home = "/root/data", .home = "/root"});
  EXPECT_EQ(folders.socket(), "/run/emberlock/emberlockd.sock");
  EXPECT_EQ(folders.sessions(), "/var/lib/emberlock/sessions");
}

TEST(DaemonFolders, AServicesAreWhatSystemdMadeForIt) {
  const DaemonFolders folders = daemon_folders({.user = 998,
                                                .runtime_directory = "/run/emberlock:/run/other",
                                                .state_directory = "/var/lib/emberlock",
                                                .xdg_runtime_dir = "/run/user/998",
                                                .home = "/home/e"});
  EXPECT_EQ(folders.socket(), "/run/emberlock/emberlockd.sock");
  EXPECT_EQ(folders.sessions(), "/var/lib/emberlock/sessions");
}

TEST(DaemonFolders, AnOrdinaryUsersAreTheirOwn) {
  DaemonSurroundings ada{.user = kNobodysId,
                         .xdg_runtime_dir = "/run/user/7",
                         .xdg_data_home = "/data/ada",
                         .home = "/home/ada"};
  EXPECT_EQ(daemon_folders(ada).socket(), "/run/user/7/emberlock/emberlockd.sock");
  EXPECT_EQ(daemon_folders(ada).sessions(), "/data/ada/emberlock/sessions");
  ada.xdg_data_home = "data";  // relative: to be ignored, says the specification
  EXPECT_EQ(daemon_folders(ada).sessions(), "/home/ada/.local/share/emberlock/sessions");
  ada.xdg_runtime_dir.clear();
  EXPECT_EQ(daemon_folders(ada).socket(), "/tmp/emberlock-3999999999/emberlockd.sock");
  ada.home.clear();
  EXPECT_EQ(daemon_folders(ada).sessions(), "/var/tmp/emberlock-3999999999/sessions");
}

}  // namespace
}  // namespace emberlock
