// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/workers.h"

#include <utility>

#include "base/priority.h"

namespace emberlock::daemon {

Workers::Workers(std::size_t threads, std::size_t waiting, Priority priority)
    : waiting_(waiting), idle_(threads) {
  for (std::size_t i = 0; i < threads; ++i) {
    threads_.emplace_back([this, priority] {
      if (priority == Priority::lowest) give_way();
      work();
    });
  }
}

Workers::~Workers() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool Workers::run(std::function<void()> call) {
  {
    const std::lock_guard lock(mutex_);
    if (queue_.size() >= idle_ + waiting_) return false;
    queue_.push_back(std::move(call));
  }
  changed_.notify_one();
  return true;
}

void Workers::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return ending_ || !queue_.empty(); });
    if (queue_.empty()) return;
    --idle_;
    {
      const std::function<void()> call = std::move(queue_.front());
      queue_.pop_front();
      lock.unlock();
      call();
    }
    lock.lock();
    ++idle_;
  }
}

}  // namespace emberlock::daemon
