// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <cstdint>

#include "base/quantity.h"

namespace emberlock {

/// An instant on one clock, in whole nanoseconds since that clock's origin. An integer, so that a recorded
/// instant is replayed exactly. Differences are `Seconds`.
struct TimePoint {
  std::int64_t ns = 0;

  friend constexpr auto operator<=>(TimePoint, TimePoint) = default;
  friend constexpr Seconds operator-(TimePoint a, TimePoint b) {
    return Seconds(static_cast<double>(a.ns - b.ns) * 1e-9);
  }
  friend TimePoint operator+(TimePoint a, Seconds d) { return {a.ns + std::llround(d.value() * 1e9)}; }
  friend TimePoint operator-(TimePoint a, Seconds d) { return a + (-d); }
};

}  // namespace emberlock
