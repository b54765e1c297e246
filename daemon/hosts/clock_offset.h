// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>

#include "base/quantity.h"
#include "base/time_point.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::daemon {

/// Another host's clock against this one's, from questions after its time (as D. L. Mills' NTP, RFC 5905,
/// section 8): the answer was given between asking and hearing, so the middle is at most half of that wrong.
/// Of the newest questions the one with the tightest bound counts, which clocks loosen as they drift.
class ClockOffset {
 public:
  static constexpr std::size_t kKept = 8;
  static constexpr PartsPerMillion kDrift{100};  ///< of two clocks at most, one against the other

  /// A question asked and heard at these times of this clock, answered with the other clock's. One that was
  /// heard before it was asked is left out; earlier ones that can't be true of the same clock are forgotten.
  void add(TimePoint asked, TimePoint there, TimePoint heard);
  /// What `at_ns` of this clock is on the other; nothing before the first answer.
  [[nodiscard]] std::optional<v1::ClockReading> reading(TimePoint at) const;
  /// How long the newest question took.
  [[nodiscard]] std::optional<Seconds> round_trip() const;

 private:
  struct Answer {
    TimePoint asked;
    TimePoint heard;
    std::int64_t ahead_ns = 0;
  };
  std::deque<Answer> answers_;  ///< the oldest first
};

}  // namespace emberlock::daemon
