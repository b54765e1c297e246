// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

using ClockReadings = google::protobuf::RepeatedPtrField<v1::ClockReading>;

/// A host's monotonic clock against the session's, which is the leading host's. It was read now and then; in
/// between it is ahead by what lies linearly between, and outside as the nearest two readings go on. By one
/// reading it is ahead by the same at any time; by none it is the session's own clock.
class HostClock {
 public:
  static constexpr double kWildestPpm = 1000;  ///< no quartz is so far off

  /// The session's own.
  HostClock() = default;
  /// Errors (bad_input; `where` names camera or host): the readings aren't in the order of time; the clock
  /// goes wrong by more than kWildestPpm, what the readings may be wrong by taken off; a reading is years
  /// away from the clock's beginning.
  static Result<HostClock> of(const ClockReadings& readings, const std::string& where);

  [[nodiscard]] bool is_the_sessions() const { return readings_.empty(); }
  /// The session's instant at which the host's clock shows `host`.
  [[nodiscard]] TimePoint on_session(TimePoint host) const;

 private:
  struct Reading {
    TimePoint host;  ///< what it showed
    std::int64_t ahead_ns = 0;
    double rate = 0;  ///< of `ahead` until the next reading, per second of this clock
  };
  explicit HostClock(std::vector<Reading> readings) : readings_(std::move(readings)) {}
  std::vector<Reading> readings_;  ///< rising
};

/// Of a camera's stamps. `where` names the manifest.
Result<HostClock> clock_of(const v1::CameraStream& camera, const std::string& where);

/// What readings of a clock tell of it at a glance.
struct ClockSummary {
  Seconds ahead;          ///< at the first reading; negative: behind
  Seconds drifted;        ///< from the first to the last
  PartsPerMillion drift;  ///< 0 by one reading
  Seconds sigma;          ///< the least certain one's
};
/// Of one reading or more.
ClockSummary summary_of(const ClockReadings& readings);

}  // namespace emberlock::session
