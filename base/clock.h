// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/time_point.h"

namespace emberlock {

/// A source of time for wrappers (threads, drivers, command loops). Pure code takes instants as arguments
/// instead. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// Returns once now() >= t; at once when t has passed.
  virtual void sleep_until(TimePoint t) = 0;
};

/// The machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override;
  void sleep_until(TimePoint t) override;
};

/// Now by the wall clock, since 1970-01-01 UTC. It may jump.
TimePoint wall_clock();

/// The same in words, as ISO 8601 in UTC with milliseconds: "2026-11-22T02:50:00.123Z".
std::string utc_now();

}  // namespace emberlock
