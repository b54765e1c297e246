// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/strobe_timeline.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace emberlock::drivers {

void StrobeTimeline::apply(const StrobeSettings& settings, TimePoint at) {
  const std::lock_guard lock(mutex_);
  Segment next{settings, at, at, period(settings.rate) / (1 + rate_error_.value() * 1e-6), 0};
  if (!segments_.empty()) {
    const Segment& last = segments_.back();
    const bool goes_on =
        last.settings.output == StrobeOutput::flashing && last.settings.rate == settings.rate;
    if (goes_on) next.base = last.base;
  }
  next.first_flash = static_cast<std::int64_t>(std::ceil((at - next.base - settings.phase) / next.period));
  next.first_flash = std::max<std::int64_t>(next.first_flash, 0);
  segments_.push_back(std::move(next));
}

void StrobeTimeline::restart(PartsPerMillion rate_error) {
  const std::lock_guard lock(mutex_);
  rate_error_ = rate_error;
  segments_.clear();
}

void StrobeTimeline::add_flashes(const Segment& segment, Seconds zero, Seconds from, Seconds to, Seconds end,
                                 std::vector<LightPulse>& pulses) {
  const StrobeSettings& s = segment.settings;
  auto j = static_cast<std::int64_t>(std::floor((from - s.width - zero) / segment.period));
  for (j = std::max(j, segment.first_flash);; ++j) {
    const Seconds begin = zero + segment.period * static_cast<double>(j);
    if (begin >= to || begin >= end) return;
    if (begin + s.width <= from) continue;
    const auto place = static_cast<std::size_t>(j - segment.first_flash);
    if (s.code.empty() || s.code[place % s.code.size()]) pulses.push_back({begin, s.width, s.output});
  }
}

std::vector<LightPulse> StrobeTimeline::light(TimePoint origin, Seconds from, Seconds to) const {
  const std::lock_guard lock(mutex_);
  std::vector<LightPulse> pulses;
  for (std::size_t i = 0; i < segments_.size(); ++i) {
    const Segment& segment = segments_[i];
    const bool last = i + 1 == segments_.size();
    const Seconds end =
        last ? Seconds(std::numeric_limits<double>::infinity()) : segments_[i + 1].applied - origin;
    if (segment.settings.output == StrobeOutput::flashing) {
      add_flashes(segment, (segment.base - origin) + segment.settings.phase, from, to, end, pulses);
    } else if (segment.settings.output == StrobeOutput::steady) {
      const Seconds begin = std::max(from, segment.applied - origin);
      const Seconds stop = std::min(to, end);
      if (begin < stop) pulses.push_back({begin, stop - begin, StrobeOutput::steady});
    }
  }
  return pulses;
}

}  // namespace emberlock::drivers
