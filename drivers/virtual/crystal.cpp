// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/crystal.h"

#include <cmath>
#include <numbers>

#include "base/random.h"

namespace emberlock::drivers {
namespace {

constexpr int kWaves = 9;
constexpr double kShortest = 600;  // s
constexpr double kHour = 3600;

}  // namespace

Crystal::Crystal(PartsPerMillion wander, std::uint64_t seed) {
  if (wander == PartsPerMillion(0)) return;
  RandomStream random(seed, 0);
  double squared = 0;  // of the change within an hour, for these amplitudes
  for (int i = 0; i < kWaves; ++i) {
    const double period = kShortest * std::exp2(i);
    const double angular = 2 * std::numbers::pi / period;
    waves_.push_back({std::sqrt(period), angular, 2 * std::numbers::pi * random.uniform()});
    squared += period * (1 - std::cos(angular * kHour));
  }
  for (Wave& wave : waves_) wave.rate *= 1e-6 * wander.value() / std::sqrt(squared);
}

PartsPerMillion Crystal::rate(TimePoint at) const {
  const double t = (at - TimePoint{}).value();
  double rate = 0;
  for (const Wave& w : waves_) rate += w.rate * std::sin(w.angular * t + w.phase);
  return PartsPerMillion(1e6 * rate);
}

Seconds Crystal::ahead(TimePoint at) const {
  const double t = (at - TimePoint{}).value();
  double ahead = 0;
  for (const Wave& w : waves_)
    ahead += w.rate / w.angular * (std::cos(w.phase) - std::cos(w.angular * t + w.phase));
  return Seconds(ahead);
}

}  // namespace emberlock::drivers
