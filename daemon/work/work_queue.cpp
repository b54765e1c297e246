// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/work_queue.h"

#include <algorithm>
#include <utility>

#include "base/priority.h"

namespace emberlock::daemon {

WorkQueue::WorkQueue() : thread_([this] { work(); }) {}

WorkQueue::~WorkQueue() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void WorkQueue::add(Work work) {
  {
    const std::scoped_lock lock(mutex_);
    const auto same = [&](const Work& w) { return w.kind == work.kind && w.session == work.session; };
    if (std::any_of(queue_.begin(), queue_.end(), same)) return;
    queue_.push_back(std::move(work));
  }
  changed_.notify_all();
}

void WorkQueue::pause() {
  const std::scoped_lock lock(mutex_);
  paused_ = true;
}

void WorkQueue::resume() {
  {
    const std::scoped_lock lock(mutex_);
    paused_ = false;
  }
  changed_.notify_all();
}

v1::BackgroundJob WorkQueue::shown(std::size_t place) const {
  const bool in_work = working_ && place == 0;
  v1::BackgroundJob job;
  job.set_kind(queue_[place].kind);
  job.set_session(queue_[place].session);
  job.set_state(paused_   ? v1::BackgroundJob::PAUSED
                : in_work ? v1::BackgroundJob::RUNNING
                          : v1::BackgroundJob::WAITING);
  if (!in_work) return job;
  job.set_fraction(fraction_);
  job.set_doing(doing_);
  return job;
}

std::vector<v1::BackgroundJob> WorkQueue::progress() const {
  const std::scoped_lock lock(mutex_);
  std::vector<v1::BackgroundJob> jobs;
  for (std::size_t i = 0; i < queue_.size(); ++i) jobs.push_back(shown(i));
  return jobs;
}

std::optional<v1::BackgroundJob> WorkQueue::find(v1::BackgroundJob::Kind kind,
                                                 std::string_view session) const {
  const std::scoped_lock lock(mutex_);
  for (std::size_t i = 0; i < queue_.size(); ++i)
    if (queue_[i].kind == kind && queue_[i].session == session) return shown(i);
  return std::nullopt;
}

void WorkQueue::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (queue_.empty() && !telling_) || paused_; });
}

/// The next to do; none at the end.
std::optional<Work> WorkQueue::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ending_ || (!paused_ && !queue_.empty()); });
  if (ending_) return std::nullopt;
  working_ = true;
  fraction_ = 0;
  doing_.clear();
  return queue_.front();
}

bool WorkQueue::go_on(double fraction, std::string_view doing) {
  std::unique_lock lock(mutex_);
  fraction_ = fraction;
  doing_ = doing;
  changed_.wait(lock, [this] { return ending_ || !paused_; });
  return !ending_;
}

void WorkQueue::work() {
  give_way();
  while (const auto work = next()) {
    const Status outcome =
        work->run([this](double fraction, std::string_view doing) { return go_on(fraction, doing); });
    bool ended = false;
    {
      const std::scoped_lock lock(mutex_);
      ended = ending_ && !outcome.ok();
      queue_.pop_front();
      working_ = false;
      telling_ = true;
    }
    if (work->done && !ended) work->done(outcome);
    {
      const std::scoped_lock lock(mutex_);
      telling_ = false;
    }
    changed_.notify_all();
  }
}

}  // namespace emberlock::daemon
