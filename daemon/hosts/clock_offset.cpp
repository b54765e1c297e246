// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/clock_offset.h"

#include <cmath>

namespace emberlock::daemon {

void ClockOffset::add(TimePoint asked, TimePoint there, TimePoint heard) {
  if (heard < asked) return;
  const Answer answer{asked, heard, there.ns - (asked.ns + (heard.ns - asked.ns) / 2)};
  // One of the machines may have been started anew: then both can't be true of one clock.
  std::erase_if(answers_, [&](const Answer& before) {
    const Seconds wrong = 0.5 * (before.heard - before.asked) + 0.5 * (heard - asked) +
                          1e-6 * kDrift.value() * (heard - before.asked);
    return std::abs(1e-9 * (static_cast<double>(answer.ahead_ns) - static_cast<double>(before.ahead_ns))) >
           wrong.value() + 1e-6;
  });
  answers_.push_back(answer);
  if (answers_.size() > kKept) answers_.pop_front();
}

std::optional<v1::ClockReading> ClockOffset::reading(TimePoint at) const {
  const Answer* best = nullptr;
  Seconds sigma;
  for (const Answer& answer : answers_) {
    const Seconds wrong =
        0.5 * (answer.heard - answer.asked) + 1e-6 * kDrift.value() * abs(at - answer.heard);
    if (best != nullptr && wrong > sigma) continue;
    best = &answer;
    sigma = wrong;
  }
  if (best == nullptr) return std::nullopt;
  v1::ClockReading reading;
  reading.set_at_ns(at.ns);
  reading.set_ahead_ns(best->ahead_ns);
  reading.set_sigma_ns(std::llround(1e9 * sigma.value()));
  return reading;
}

std::optional<Seconds> ClockOffset::round_trip() const {
  if (answers_.empty()) return std::nullopt;
  return answers_.back().heard - answers_.back().asked;
}

}  // namespace emberlock::daemon
