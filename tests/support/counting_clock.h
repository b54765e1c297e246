// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/clock.h"

namespace emberlock::test {

/// Time that passes by a millisecond at every look.
class CountingClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override { return {1000000 * ++looks_}; }
  void sleep_until(TimePoint) override {}

 private:
  mutable std::int64_t looks_ = 0;
};

}  // namespace emberlock::test
