// SPDX-License-Identifier: Apache-2.0
// bin/emberlock. What needs cameras, films or volumes loads some two hundred libraries, so it is a program of
// its own (verbs.cpp), which takes this one's place: the version, and what only asks the daemon, don't wait
// for them.
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <string>
#include <system_error>

#include <unistd.h>

#include "base/version.h"
#include "cli/commands.h"
#include "cli/help.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;

/// Returns only where there is no such program.
int hand_on(char** argv) {
  std::error_code error;
  const fs::path itself = fs::read_symlink("/proc/self/exe", error);
  const fs::path verbs = itself.parent_path().parent_path() / "libexec/emberlock/emberlock";
  if (!error) {
    ::execv(verbs.c_str(), argv);
    error = {errno, std::system_category()};
  }
  const Error gone{ErrorKind::io, "can't be started: " + error.message(), verbs.string(),
                   "bin/emberlock needs it: install both"};
  std::fprintf(stderr, "emberlock: %s\n", gone.message().c_str());
  return 1;
}

}  // namespace
}  // namespace emberlock::cli

int main(int argc, char** argv) {
  const std::string first = argc > 1 ? argv[1] : "";
  if (argc == 2 && first == "--version") {
    std::printf("emberlock %s\n", emberlock::version().c_str());
    return 0;
  }
#if EMBERLOCK_WITH_DAEMON
  const emberlock::cli::CommandLine line;
  line.program().require_verb();
  emberlock::cli::style_help(line.program());
  emberlock::cli::add_client(line.program());
  if (line.program().has_verb(first)) return emberlock::cli::run(line, argc, argv);
#endif
  return emberlock::cli::hand_on(argv);
}
