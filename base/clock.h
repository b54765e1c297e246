// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/time_point.h"

namespace emberlock {

/// A source of time for code that drives threads, devices or command loops. Pure functions take instants as
/// arguments instead. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;
  [[nodiscard]] virtual TimePoint now() const = 0;
  /// Returns as soon as now() >= t; immediately when t has already passed.
  virtual void sleep_until(TimePoint t) = 0;
};

/// The machine's monotonic clock.
class SteadyClock final : public Clock {
 public:
  [[nodiscard]] TimePoint now() const override;
  void sleep_until(TimePoint t) override;
};

/// The wall clock, since 1970-01-01 UTC. It may jump.
TimePoint wall_clock();

/// wall_clock() as ISO 8601 text in UTC with milliseconds: "2026-11-22T02:50:00.123Z".
std::string utc_now();

}  // namespace emberlock
