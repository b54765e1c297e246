// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/clock.h"

namespace emberlock::test {

/// Time that passes by a tick at every look, and by what a test lets pass.
class CountingClock final : public Clock {
 public:
  explicit CountingClock(Seconds tick = Seconds(1e-3)) : tick_(tick) {}
  [[nodiscard]] TimePoint now() const override { return time_ = time_ + tick_; }
  void sleep_until(TimePoint) override {}
  void pass(Seconds time) { time_ = time_ + time; }

 private:
  Seconds tick_;
  mutable TimePoint time_;
};

}  // namespace emberlock::test
