// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

namespace emberlock::test {

using Environment = std::vector<std::pair<std::string, std::string>>;

/// A program that runs in the background, and is killed with this object.
class Program {
 public:
  /// `command`: the program's path and its arguments. `environment` is added to this process's. stdout and
  /// stderr go to the file `log`, if one is named.
  explicit Program(const std::vector<std::string>& command, const Environment& environment = {},
                   const std::string& log = {}) {
    std::vector<char*> words;
    for (const std::string& word : command) words.push_back(const_cast<char*>(word.c_str()));
    words.push_back(nullptr);
    pid_ = ::fork();
    if (pid_ != 0) return;
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    if (!log.empty() && (std::freopen(log.c_str(), "w", stderr) == nullptr || ::dup2(2, 1) < 0)) ::_exit(126);
    ::execv(words.front(), words.data());
    ::_exit(127);
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;
  ~Program() {
    if (pid_ > 0) end(SIGKILL);
  }
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
  void send(int signal) const {
    if (pid_ > 0) ::kill(pid_, signal);
  }
  /// Its exit status, or minus the signal that ended it.
  int wait() { return status_of(0).value_or(-1); }
  /// The same; none while it runs.
  std::optional<int> ended() { return status_of(WNOHANG); }
  int end(int signal) {
    send(signal);
    return wait();
  }

 private:
  std::optional<int> status_of(int options) {
    int status = 0;
    if (::waitpid(pid_, &status, options) != pid_) return std::nullopt;
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  pid_t pid_ = -1;
};

}  // namespace emberlock::test
