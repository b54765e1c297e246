#include "daemon/server/job.h"

#include <utility>

namespace emberlock {

void Job::run(const std::function<Status(const JobObserver&)>& job) {
  const auto cancelled = [this] {
    const std::lock_guard lock(mutex_);
    return !changed_;
  };
  if (cancelled()) return;
  Status status = job([&](const v1::JobProgress& progress) {
    {
      const std::lock_guard lock(mutex_);
      newest_ = progress;
    }
    tell();
    return !cancelled();
  });
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

}  // namespace emberlock
