// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <sys/types.h>

#include "base/result.h"

namespace emberlock::drivers {

/// A command line of the user's that switches a camera's power off and on, run by the shell. It is told which
/// camera by the environment variable EMBERLOCK_CAMERA. Destroyed while it runs it is left to end by itself,
/// as a camera that it has switched off would stay off; after a minute it is killed with what it started.
class PowerCommand {
 public:
  enum class State { running, succeeded, failed };

  /// Error io: no process could be started.
  static Result<PowerCommand> start(const std::string& command_line, const std::string& camera);
  PowerCommand(PowerCommand&& o) noexcept;
  PowerCommand& operator=(PowerCommand&& o) noexcept;
  ~PowerCommand();

  /// Without waiting.
  State state();

 private:
  explicit PowerCommand(pid_t pid) : pid_(pid) {}
  pid_t pid_;
  State state_ = State::running;
};

}  // namespace emberlock::drivers
