// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <mutex>
#include <vector>

#include "base/quantity.h"
#include "base/time_point.h"
#include "drivers/strobe.h"

namespace emberlock::drivers {

/// Light of the strobe: a flash, or an interval of steady light.
struct LightPulse {
  Seconds begin;  ///< relative to the requested origin; may be negative
  Seconds width;
  StrobeOutput kind = StrobeOutput::flashing;
};

/// All settings that a strobe received, and so every flash that it gave or will give: an exact function of
/// the settings and the times at which they were applied. Flash j of a setting begins at base + phase + j /
/// rate, j >= 0. The base is the time of apply() when the rate changes or flashing starts, and unchanged
/// otherwise, so that a new phase shifts the flashes by the difference. A code restarts at the first flash
/// after apply(). A flash that has begun ends normally. Thread-safe.
class StrobeTimeline {
 public:
  /// `rate_error`: the true rate is that of the settings times (1 + rate_error).
  explicit StrobeTimeline(PartsPerMillion rate_error) : rate_error_(rate_error) {}

  /// `at` must not be before that of the last call; `settings` must be valid.
  void apply(const StrobeSettings& settings, TimePoint at);

  /// Forgets all settings: dark until the next apply().
  void restart(PartsPerMillion rate_error);

  /// The light that overlaps [origin + from, origin + to), in order of time; steady light is cut to that
  /// interval.
  [[nodiscard]] std::vector<LightPulse> light(TimePoint origin, Seconds from, Seconds to) const;

 private:
  struct Segment {
    StrobeSettings settings;
    TimePoint applied;
    TimePoint base;
    Seconds period;
    std::int64_t first_flash = 0;  // its number j, at which the code begins
  };
  /// Adds the segment's flashes that overlap [from, to) and begin before `end`; flash 0 would begin at
  /// `zero`.
  static void add_flashes(const Segment& segment, Seconds zero, Seconds from, Seconds to, Seconds end,
                          std::vector<LightPulse>& pulses);

  PartsPerMillion rate_error_;
  mutable std::mutex mutex_;
  std::vector<Segment> segments_;
};

}  // namespace emberlock::drivers
