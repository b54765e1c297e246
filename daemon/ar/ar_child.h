// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "daemon/reconstruction/child_output.h"
#include "daemon/reconstruction/process.h"
#include "emberlock/v1/child.pb.h"
#include "session/child_messages.h"

namespace emberlock::daemon {

/// `emberlock ar-live`, which draws: one message to it, one answer back. For one thread, which must be the
/// one that started it, as the child dies with it.
class ArChild {
 public:
  /// `command` ends with the descriptor's option. Errors: those of ChildProcess::spawn_fed().
  static Result<ArChild> start(const std::vector<std::string>& command, int niceness);

  /// Errors: what the child tells itself (bad_input); it ended, or sends what can't be understood (device);
  /// no answer in time (timed_out); `ending` came to be true meanwhile (refused).
  Result<v1::ChildMessage> ask(const v1::ArInput& input, Seconds patience,
                               const std::function<bool()>& ending);

 private:
  explicit ArChild(ChildProcess process) : process_(std::move(process)) {}
  Status read_answer(std::optional<v1::ChildMessage>& answer);
  [[nodiscard]] Error why_it_ended();

  ChildProcess process_;
  session::ChildMessageParser parser_;
  LastWords last_words_;
};

}  // namespace emberlock::daemon
