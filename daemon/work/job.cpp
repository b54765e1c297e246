// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/job.h"

#include <utility>

namespace emberlock::daemon {

v1::Job JobHandle::state_now() const {
  const auto seconds_since = [](Steady::time_point t) {
    return std::chrono::duration<double>(Steady::now() - t).count();
  };
  v1::Job job = state_;
  if (result_) return job;
  if (began_) job.set_seconds(seconds_since(*began_));
  if (began_ && !paused_) job.set_silent_s(seconds_since(told_));
  if (paused_) job.set_state(v1::Job::PAUSED);
  return job;
}

v1::Job JobHandle::state() const {
  const std::scoped_lock lock(mutex_);
  return state_now();
}

std::optional<v1::Job> JobHandle::news(std::uint64_t& seen) const {
  const std::scoped_lock lock(mutex_);
  if (std::exchange(seen, number_) == number_) return std::nullopt;
  return state_now();
}

std::optional<JobResult> JobHandle::result() const { return wait(std::chrono::milliseconds(0)); }

std::optional<JobResult> JobHandle::wait(std::chrono::milliseconds longest) const {
  std::unique_lock lock(mutex_);
  woken_.wait_for(lock, longest, [this] { return result_.has_value(); });
  return result_;
}

void JobHandle::cancel() {
  {
    const std::scoped_lock lock(mutex_);
    if (result_) return;
    cancelled_ = true;
    if (!began_) {
      state_.set_state(v1::Job::CANCELLED);
      result_ = Error{ErrorKind::refused, "ended early, as asked", state_.session()};
      ++number_;
    }
  }
  tell();
}

void JobHandle::watch(std::function<void()> changed) {
  const std::scoped_lock lock(watching_);
  changed_ = std::move(changed);
}

void JobHandle::tell() {
  woken_.notify_all();
  const std::scoped_lock lock(watching_);
  if (changed_) changed_();
}

bool JobHandle::begin() {
  {
    std::unique_lock lock(mutex_);
    woken_.wait(lock, [this] { return cancelled_ || !paused_; });
    if (cancelled_) return false;
    began_ = told_ = Steady::now();
    state_.set_state(v1::Job::RUNNING);
    ++number_;
  }
  tell();
  return true;
}

bool JobHandle::go_on(double fraction, std::string_view doing) {
  {
    const std::scoped_lock lock(mutex_);
    told_ = Steady::now();
    state_.set_fraction(fraction);
    state_.set_doing(std::string(doing));
    ++number_;
  }
  tell();
  std::unique_lock lock(mutex_);
  woken_.wait(lock, [this] { return cancelled_ || !paused_; });
  told_ = Steady::now();
  return !cancelled_;
}

void JobHandle::end(JobResult result) {
  {
    const std::scoped_lock lock(mutex_);
    if (began_) state_.set_seconds(std::chrono::duration<double>(Steady::now() - *began_).count());
    state_.set_state(result.ok() ? v1::Job::DONE : cancelled_ ? v1::Job::CANCELLED : v1::Job::FAILED);
    if (result.ok()) {
      state_.set_fraction(1);
      *state_.mutable_outcome() = *result;
    }
    result_ = std::move(result);
    ++number_;
  }
  tell();
}

void JobHandle::pause(bool paused) {
  {
    const std::scoped_lock lock(mutex_);
    if (paused_ == paused) return;
    paused_ = paused;
    ++number_;
  }
  tell();
}

}  // namespace emberlock::daemon
