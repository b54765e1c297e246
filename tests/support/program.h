// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace emberlock::test {

/// emberlockd, on a configuration of its own, killed with this object.
class Program {
 public:
  /// `environment` is added to this one's.
  explicit Program(const char* program, const std::string& config,
                   const std::vector<std::pair<std::string, std::string>>& environment = {}) {
    pid_ = ::fork();
    if (pid_ != 0) return;
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    ::execl(program, "emberlockd", "--config", config.c_str(), nullptr);
    ::_exit(127);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() {
    if (pid_ > 0) end(SIGKILL);
  }
  [[nodiscard]] pid_t pid() const { return pid_; }
  /// Seconds of processors that it has used so far.
  [[nodiscard]] double processor_seconds() const {
    std::ifstream stat("/proc/" + std::to_string(pid_) + "/stat");
    std::string text;
    std::getline(stat, text);
    std::istringstream fields(text.substr(text.rfind(')') + 2));
    std::string skipped;
    for (int i = 0; i < 11; ++i) fields >> skipped;
    double user = 0;
    double system = 0;
    fields >> user >> system;
    return (user + system) / static_cast<double>(::sysconf(_SC_CLK_TCK));
  }
  void tell(int signal) const {
    if (pid_ > 0) ::kill(pid_, signal);
  }
  /// Its exit status, or minus the signal that ended it.
  int wait() {
    int status = 0;
    ::waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  int end(int signal) {
    tell(signal);
    return wait();
  }

 private:
  pid_t pid_ = -1;
};

}  // namespace emberlock::test
