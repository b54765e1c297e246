// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <sys/types.h>

#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock::daemon {

/// A program in a process group of its own: stdin is what it is given, stdout /dev/null, descriptor 3 its
/// messages' pipe; it has no other of ours. Destroyed, it is killed with all that it started, and reaped.
class ChildProcess {
 public:
  static constexpr int kMessagesFd = 3;  ///< in the child

  struct Exit {
    int code = 0;
    int signal = 0;  ///< not 0: it died by it
  };

  /// `command[0]` is the program, looked for on PATH where it has no slash; `niceness` 0..19; it reads
  /// `input`, from a file in memory, on its stdin. Errors name the program.
  static Result<ChildProcess> spawn(const std::vector<std::string>& command, int niceness,
                                    std::string_view input = {});
  /// The same with `input` itself as its stdin.
  static Result<ChildProcess> spawn(const std::vector<std::string>& command, int niceness,
                                    const UniqueFd& input);
  /// The same, but its stdin is a socket: what is sent to input().
  static Result<ChildProcess> spawn_fed(const std::vector<std::string>& command, int niceness);
  ChildProcess(ChildProcess&& other) noexcept
      : pid_(std::exchange(other.pid_, -1)),
        exited_(std::move(other.exited_)),
        messages_(std::move(other.messages_)),
        errors_(std::move(other.errors_)),
        input_(std::move(other.input_)) {}
  ChildProcess& operator=(ChildProcess&&) = delete;
  ~ChildProcess();

  // To poll: readable when it has exited; its messages; its stderr. The pipes never block.
  [[nodiscard]] int exited() const { return exited_.get(); }
  [[nodiscard]] int messages() const { return messages_.get(); }
  [[nodiscard]] int errors() const { return errors_.get(); }
  /// Of spawn_fed(): never blocks either.
  [[nodiscard]] int input() const { return input_.get(); }

  /// To the whole group, until reap().
  void signal(int signal) const;
  /// Kills it, if it still runs, and what it started, and waits for it. Once.
  Exit reap();

 private:
  ChildProcess(pid_t pid, UniqueFd exited, UniqueFd messages, UniqueFd errors)
      : pid_(pid), exited_(std::move(exited)), messages_(std::move(messages)), errors_(std::move(errors)) {}

  pid_t pid_ = -1;
  UniqueFd exited_, messages_, errors_, input_;
};

}  // namespace emberlock::daemon
