// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "base/random.h"

namespace emberlock::test {

/// What lights and darkens a lamp while cameras film it, as it happens and not as anybody designed it.
enum class LightPattern {
  hand,       ///< passed before the lamp at odd intervals
  torch,      ///< switched on and off by hand
  burst,      ///< dark but for bursts of a few flashes
  code,       ///< each flash given or not, by the throw of a coin that isn't fair
  few_skips,  ///< one flash in sixteen isn't given, at unlike gaps
  periodic,   ///< the same few flashes again and again: tells no frames
  one_swipe,  ///< a hand, once
  steady,     ///< all are given
};
inline constexpr std::array kTellingPatterns{LightPattern::hand, LightPattern::torch, LightPattern::burst,
                                             LightPattern::code, LightPattern::few_skips};
inline std::string_view name(LightPattern kind) {
  constexpr std::array<std::string_view, 8> kNames{"hand",      "torch",    "burst",     "code",
                                                   "few skips", "periodic", "one swipe", "steady"};
  return kNames.at(static_cast<std::size_t>(kind));
}

/// Whether each of so many flashes is given.
inline std::vector<bool> light_pattern(LightPattern kind, int flashes, RandomStream& random) {
  std::vector<bool> given;
  const auto run = [&](bool lit, double shortest, double longest) {
    given.insert(given.end(), static_cast<std::size_t>(random.uniform(shortest, longest + 1)), lit);
  };
  const double share = random.uniform(0.3, 0.85);
  const auto period = static_cast<std::size_t>(random.uniform(2, 24));
  std::vector<bool> repeated;
  for (std::size_t i = 0; i < period; ++i) repeated.push_back(i == 0 || random.uniform() < 0.6);
  const int swipe = static_cast<int>(random.uniform(0.3, 0.7) * flashes);
  int next_skip = static_cast<int>(random.uniform(4, 20));
  while (static_cast<int>(given.size()) < flashes) {
    const int at = static_cast<int>(given.size());
    switch (kind) {
      case LightPattern::hand:
        run(true, 6, 40);
        run(false, 3, 16);
        break;
      case LightPattern::torch:
        run(true, 3, 24);
        run(false, 3, 24);
        break;
      case LightPattern::burst:
        run(false, 4, 30);
        run(true, 1, 10);
        break;
      case LightPattern::code:
        given.push_back(random.uniform() < share);
        break;
      case LightPattern::few_skips:
        given.push_back(at != next_skip);
        if (at == next_skip) next_skip = at + static_cast<int>(random.uniform(6, 27));
        break;
      case LightPattern::periodic:
        given.push_back(repeated[given.size() % period]);
        break;
      case LightPattern::one_swipe:
        given.push_back(at < swipe || at >= swipe + 9);
        break;
      case LightPattern::steady:
        given.push_back(true);
        break;
    }
  }
  given.resize(static_cast<std::size_t>(flashes));
  return given;
}

}  // namespace emberlock::test
