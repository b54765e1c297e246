// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/job.h"

#include <utility>

namespace emberlock::daemon {

void Job::run(const std::function<Status(const JobObserver&)>& job) {
  const auto cancelled = [this] {
    const std::lock_guard lock(mutex_);
    return !changed_;
  };
  if (cancelled()) return;
  bool done = false;
  Status status = job([&](const v1::JobProgress& progress) {
    done = progress.done();
    {
      const std::lock_guard lock(mutex_);
      newest_ = progress;
    }
    tell();
    return !cancelled();
  });
  if (status.ok() && !done)
    status = Error{ErrorKind::io, "it ended without saying what came of it", "emberlockd",
                   "Ask again; the daemon's journal may say why"};
  {
    const std::lock_guard lock(mutex_);
    ended_ = std::move(status);
  }
  tell();
}

void Job::cancel() {
  const std::lock_guard lock(mutex_);
  changed_ = nullptr;
}

void Job::tell() {
  const std::lock_guard lock(mutex_);
  if (changed_) changed_();
}

std::optional<v1::JobProgress> Job::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

std::optional<Status> Job::ended() const {
  const std::lock_guard lock(mutex_);
  return newest_ ? std::nullopt : ended_;
}

}  // namespace emberlock::daemon
