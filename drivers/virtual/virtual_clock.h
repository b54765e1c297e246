// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>

#include "base/clock.h"

namespace emberlock::drivers {

/// A clock that advances only when somebody sleeps on it. Sleeping takes no real time, and runs are
/// reproducible. With one thread its instants are deterministic; with several it stands at the latest instant
/// that any thread slept until. Thread-safe.
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
