// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/job_watch.h"

#include <utility>

namespace emberlock::daemon {

void JobWatch::begin(Result<std::shared_ptr<JobHandle>> asked) {
  const std::scoped_lock lock(mutex_);
  if (asked.ok()) {
    job_ = std::move(*asked);
    if (left_) return job_->cancel();
    job_->watch(changed_);
  } else {
    refusal_ = asked.error();
  }
  if (!left_) changed_();
}

void JobWatch::leave() {
  const std::scoped_lock lock(mutex_);
  left_ = true;
  if (!job_) return;
  job_->watch({});
  job_->cancel();
}

std::optional<v1::Job> JobWatch::take() {
  const std::scoped_lock lock(mutex_);
  if (!job_) return std::nullopt;
  std::optional<v1::Job> job = job_->news(seen_);
  if (job && (job->state() == v1::Job::FAILED || job->state() == v1::Job::CANCELLED)) return std::nullopt;
  all_taken_ = all_taken_ || (job && job->state() == v1::Job::DONE);
  return job;
}

std::optional<Status> JobWatch::ended() const {
  const std::scoped_lock lock(mutex_);
  if (refusal_) return *refusal_;
  if (!job_) return std::nullopt;
  const auto result = job_->result();
  if (!result) return std::nullopt;
  if (!result->ok()) return result->error();
  return all_taken_ ? std::optional<Status>(Status()) : std::nullopt;
}

}  // namespace emberlock::daemon
