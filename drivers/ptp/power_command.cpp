// SPDX-License-Identifier: Apache-2.0
#include "drivers/ptp/power_command.h"

#include <chrono>
#include <csignal>
#include <cstring>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

namespace emberlock::drivers {
namespace {

/// How long an abandoned command may continue.
constexpr std::chrono::milliseconds kLongest{60000};

}  // namespace

Result<PowerCommand> PowerCommand::start(const std::string& command_line, const std::string& camera) {
  std::string shell = "/bin/sh";
  std::string flag = "-c";
  std::string line = command_line;
  char* const arguments[] = {shell.data(), flag.data(), line.data(), nullptr};
  std::string named = "EMBERLOCK_CAMERA=" + camera;
  std::vector<char*> environment;
  for (char** entry = environ; *entry != nullptr; ++entry) {
    if (!std::string_view(*entry).starts_with("EMBERLOCK_CAMERA=")) environment.push_back(*entry);
  }
  environment.push_back(named.data());
  environment.push_back(nullptr);

  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes,
                           POSIX_SPAWN_SETPGROUP);  // so that its child processes can be killed too
  pid_t pid = 0;
  const int error = ::posix_spawn(&pid, shell.c_str(), nullptr, &attributes, arguments, environment.data());
  posix_spawnattr_destroy(&attributes);
  if (error != 0) return Error{ErrorKind::io, std::strerror(error), "power command \"" + command_line + '"'};
  return PowerCommand(pid);
}

PowerCommand::PowerCommand(PowerCommand&& o) noexcept : pid_(std::exchange(o.pid_, -1)), state_(o.state_) {}

PowerCommand& PowerCommand::operator=(PowerCommand&& o) noexcept {
  std::swap(pid_, o.pid_);
  std::swap(state_, o.state_);
  return *this;
}

PowerCommand::~PowerCommand() {
  if (pid_ < 0 || state() != State::running) return;
  std::thread([pid = pid_] {
    constexpr auto kPause = std::chrono::milliseconds(100);
    for (auto left = kLongest; left.count() > 0; left -= kPause) {
      if (::waitpid(pid, nullptr, WNOHANG) != 0) return;
      std::this_thread::sleep_for(kPause);
    }
    ::kill(-pid, SIGKILL);
    ::waitpid(pid, nullptr, 0);
  }).detach();
}

PowerCommand::State PowerCommand::state() {
  int status = 0;
  if (state_ == State::running && ::waitpid(pid_, &status, WNOHANG) == pid_) {
    state_ = WIFEXITED(status) && WEXITSTATUS(status) == 0 ? State::succeeded : State::failed;
  }
  return state_;
}

}  // namespace emberlock::drivers
