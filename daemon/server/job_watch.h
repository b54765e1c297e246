// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>

#include "daemon/api.h"

namespace emberlock::daemon {

/// A job as the client that asked for it sees it: only the newest state. Thread-safe.
class JobWatch {
 public:
  /// `changed` is called after each change, on the thread that makes it, and returns at once.
  explicit JobWatch(std::function<void()> changed) : changed_(std::move(changed)) {}

  /// Takes the Api's answer.
  void begin(Result<std::shared_ptr<JobHandle>> asked);
  /// The client has disconnected: cancels the job; `changed` isn't called again.
  void leave();

  /// The newest state, if it wasn't taken yet. Not that of a failed job, which ended() reports.
  [[nodiscard]] std::optional<v1::Job> take();
  /// Set once the job has failed (or couldn't begin), or is done and its last state was taken.
  [[nodiscard]] std::optional<Status> ended() const;

 private:
  mutable std::mutex mutex_;
  const std::function<void()> changed_;
  std::optional<Error> refusal_;
  std::shared_ptr<JobHandle> job_;
  std::uint64_t seen_ = 0;
  bool all_taken_ = false;
  bool left_ = false;
};

}  // namespace emberlock::daemon
