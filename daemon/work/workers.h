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

/// A few threads for long calls, and a bounded queue. Thread-safe.
class Workers {
 public:
  enum class Priority {
    normal,
    lowest,  ///< background priority, for processor and disk
  };

  /// At most `waiting` calls are queued while `threads` run.
  Workers(std::size_t threads, std::size_t waiting, Priority priority = Priority::normal);
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;
  /// Completes the queued calls.
  ~Workers();

  /// False when the queue is full; the call isn't run then.
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
