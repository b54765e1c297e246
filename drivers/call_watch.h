// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <string_view>

#include "base/thread_load.h"

namespace emberlock::drivers {

/// Watches a thread's calls into a device, each of which has a deadline. A call that is late because the
/// thread is busy, or waits for a processor, doesn't hang: the machine is overloaded. Not thread-safe.
class CallWatch {
 public:
  using Time = std::chrono::steady_clock::time_point;

  /// By the thread that makes the calls, before the first.
  void adopt_thread() { thread_ = thread_id(); }
  void begin(std::string_view call, Time now, Time deadline);
  void end() { under_way_ = false; }

  [[nodiscard]] bool late(Time now) const { return under_way_ && now > late_from_; }
  [[nodiscard]] bool hangs(Time now) const { return late(now) && !works(now); }
  /// When to look again, at `until` at the latest.
  [[nodiscard]] Time next_look(Time now, Time until) const;
  /// "it hangs, for 3.1 s so far, in next_frame"
  [[nodiscard]] std::string words(Time now) const;

 private:
  [[nodiscard]] bool works(Time now) const;

  int thread_ = 0;
  std::string_view call_;
  Time began_;
  Time late_from_;
  bool under_way_ = false;
  std::optional<ThreadLoad> before_;  ///< the call
};

}  // namespace emberlock::drivers
