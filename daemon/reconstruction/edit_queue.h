// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "emberlock/v1/child.pb.h"

namespace emberlock::daemon {

/// Steps on their way to a stylization's child, and its answers on their way back, in the same order. Callers
/// wait for theirs; one thread, which watches the child, moves the bytes. Thread-safe.
class EditQueue {
 public:
  EditQueue();

  /// For a new child: the end of a socket that it reads. Errors: io.
  Result<UniqueFd> open();
  /// Hands a step over and waits for the child's answer. Errors: what the child says, bad_input, and that of
  /// a step too large; `refused` where no child listens any more; `timed_out`: the step may yet be taken.
  Result<v1::StylizationStatus> ask(const v1::EditRequest& request, Seconds longest);
  /// The child reads that nothing comes any more, behind all steps. Error `refused`: none listens.
  Status finish();

  // Of the thread that watches the child.
  /// To poll: readable when there is something for send() to do.
  [[nodiscard]] int woken() const { return woken_.get(); }
  /// To poll: writable when send() can go on; -1: nothing is left to send.
  [[nodiscard]] int blocked() const;
  /// As much as the child's socket takes now.
  void send();
  /// The child's answer to the oldest step that isn't answered.
  void take(const v1::ChildMessage::Edited& answer);
  /// The child is gone.
  void close();

 private:
  struct Asked {
    std::optional<v1::ChildMessage::Edited> answer;
    bool gone = false;  ///< there will be none
  };
  [[nodiscard]] bool listens() const { return to_child_ && !finishing_; }
  void wake() const;

  const UniqueFd woken_;
  mutable std::mutex mutex_;  ///< of what follows
  std::condition_variable answered_;
  UniqueFd to_child_;
  std::string unsent_;
  std::deque<std::shared_ptr<Asked>> asked_;
  bool finishing_ = false;
};

}  // namespace emberlock::daemon
