// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "base/clock.h"

namespace emberlock::drivers {

/// A clock that moves only when somebody sleeps on it: sleeping takes no real time, and a run is the same
/// each time. With one thread its instants are deterministic; with several the clock stands at the latest
/// instant anybody slept until. Thread-safe.
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(TimePoint start = {}) : now_ns_(start.ns) {}

  [[nodiscard]] TimePoint now() const override { return {now_ns_.load()}; }
  void sleep_until(TimePoint t) override {
    auto now = now_ns_.load();
    while (now < t.ns && !now_ns_.compare_exchange_weak(now, t.ns)) {
    }
  }

 private:
  std::atomic<std::int64_t> now_ns_;
};

}  // namespace emberlock::drivers
