// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace emberlock::daemon {

/// A few threads for calls that take long, and a queue with a bound. Thread-safe.
class Workers {
 public:
  /// `waiting` calls at most queue behind the `threads` that run.
  Workers(std::size_t threads, std::size_t waiting);
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  /// Runs what is queued to its end.
  ~Workers();

  /// False when the queue is full: nothing will run.
  [[nodiscard]] bool run(std::function<void()> call);

 private:
  void work();

  const std::size_t waiting_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> queue_;
  std::size_t idle_ = 0;
  bool ending_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace emberlock::daemon
