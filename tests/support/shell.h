// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <string>

#include <sys/wait.h>

namespace emberlock {

struct Shell {
  int status = -1;     ///< the command's exit status, or -1
  std::string output;  ///< stdout and stderr
};

/// Runs a command line by /bin/sh.
inline Shell shell(const std::string& command) {
  Shell result;
  FILE* const pipe = ::popen((command + " 2>&1").c_str(), "r");
  if (pipe == nullptr) return result;
  char text[4096];
  while (const std::size_t read = std::fread(text, 1, sizeof text, pipe)) result.output.append(text, read);
  const int status = ::pclose(pipe);
  if (WIFEXITED(status)) result.status = WEXITSTATUS(status);
  return result;
}

}  // namespace emberlock
