// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <sys/types.h>

#include "base/result.h"

namespace emberlock::drivers {

/// A command line given by the user that switches a camera's power off and on, run by the shell. The
/// environment variable EMBERLOCK_CAMERA holds the camera's id. If this object is destroyed while it runs, it
/// continues, because otherwise the camera could stay switched off; after a minute it is killed with all its
/// child processes.
class PowerCommand {
 public:
  enum class State { running, succeeded, failed };

  /// Error io: the process couldn't be started.
  static Result<PowerCommand> start(const std::string& command_line, const std::string& camera);
  PowerCommand(PowerCommand&& o) noexcept;
  PowerCommand& operator=(PowerCommand&& o) noexcept;
  ~PowerCommand();

  /// Doesn't block.
  State state();

 private:
  explicit PowerCommand(pid_t pid) : pid_(pid) {}
  pid_t pid_;
  State state_ = State::running;
};

}  // namespace emberlock::drivers
