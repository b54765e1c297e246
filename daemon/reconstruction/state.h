// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "emberlock/v1/child.pb.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

/// How a child came to its end.
struct ChildEnd {
  enum class Why {
    by_itself,  ///< `code` or `signal` says how
    cancelled,
    silent,      ///< it hung, and was killed
    unreadable,  ///< what it sent can't be understood, and it was killed
    not_started,
  };
  Why why = Why::by_itself;
  int code = 0;            ///< its exit status
  int signal = 0;          ///< not 0: it died by it
  std::string words = {};  ///< of `silent`, `unreadable` and `not_started`
};

/// What a reconstruction's messages and end say of it: pure.
class ReconstructionState {
 public:
  static constexpr int kIterations = 1000;  ///< the status has so many of the newest

  /// `begun` has id, session and device as they were asked for.
  explicit ReconstructionState(v1::ReconstructionStatus begun);

  /// What the board shall show of it, if anything.
  std::optional<v1::IterationPreview> take(v1::ChildMessage&& message);
  /// `last_words`: what it wrote to stderr, its last lines.
  void end(const ChildEnd& end, const std::string& last_words);

  [[nodiscard]] const v1::ReconstructionStatus& status() const { return status_; }

 private:
  [[nodiscard]] std::string failure(const ChildEnd& end, const std::string& last_words) const;

  v1::ReconstructionStatus status_;
  std::string told_;  ///< the failure that it told itself
  bool done_ = false;
};

}  // namespace emberlock::daemon
