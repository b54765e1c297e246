// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <mutex>
#include <optional>

#include "daemon/api.h"

namespace emberlock::daemon {

/// One of the Api's jobs on its way to one client: what it told last, until the client has gone. Shared by
/// the thread that runs it and the one that writes. Thread-safe.
class Job {
 public:
  /// `changed` is called after each progress and at the end, on the thread that runs.
  explicit Job(std::function<void()> changed) : changed_(std::move(changed)) {}

  /// Runs it to its end, on this thread. One that ends well without a last progress that is done is an error.
  void run(const std::function<Status(const JobObserver&)>& job);
  /// Nobody is interested any more: it ends at its next progress, and `changed` isn't called again.
  void cancel();

  /// The newest progress that wasn't taken yet; what it overtook is gone.
  [[nodiscard]] std::optional<v1::JobProgress> take();
  /// How it ended, once it has and its last progress is taken.
  [[nodiscard]] std::optional<Status> ended() const;

 private:
  void tell();

  mutable std::mutex mutex_;
  std::function<void()> changed_;  ///< empty once cancelled
  std::optional<v1::JobProgress> newest_;
  std::optional<Status> ended_;
};

}  // namespace emberlock::daemon
