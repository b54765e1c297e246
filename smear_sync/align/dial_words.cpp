// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/dial_words.h"

#include <cmath>

#include <fmt/format.h>

namespace emberlock::smear {

std::string setting(Hertz rate, const StrobeDial& dial) {
  return fmt::format("{} flashes a minute ({:.3f} Hz)", dial.per_minute(rate), rate.value());
}

std::string turning(Hertz from, Hertz to, const StrobeDial& dial) {
  const double percent = 100 * std::abs(to / from - 1);
  return fmt::format("turn it {} by {} ({:.{}f} %), to {}", to > from ? "up" : "down",
                     dial.per_minute(to > from ? to - from : from - to), percent, percent < 10 ? 2 : 0,
                     setting(to, dial));
}

std::string or_else(const std::vector<Hertz>& others, const StrobeDial& dial) {
  if (others.empty()) return {};
  std::string rates;
  for (const Hertz other : others) rates += (rates.empty() ? "" : ", ") + dial.per_minute(other);
  return " (or at " + rates + ", if all the flashes between fall where no camera shows them)";
}

std::string what_to_do(const FlashRate& flashes, Hertz set, const StrobeDial& dial) {
  const std::string to = setting(set, dial);
  switch (flashes.seen) {
    case FlashesSeen::rate:
      return "the strobe flashes at " + dial.per_minute(flashes.rate) + " a minute" +
             or_else(flashes.others, dial) + ": " + turning(flashes.rate, set, dial);
    case FlashesSeen::hidden:
      return "every flash falls where no camera shows it: turn the strobe a little, to " + to;
    case FlashesSeen::too_slow:
      return fmt::format("the strobe flashes at less than {:.0f} a minute: turn it up, to ",
                         60 * flashes.rate.value()) +
             to;
    case FlashesSeen::too_fast:
      return "the lamp leaves lines, not dots: it shines all the time, or flashes far too fast. Turn it "
             "down, to " +
             to;
    case FlashesSeen::unsteady:
      return "the dots don't come at one rate: leave the strobe at " + to +
             "; if this goes on, look for reflections of the lamp, and see whether each camera's read "
             "direction is right";
    case FlashesSeen::none:
      break;
  }
  return "no flash is seen, all through the round: switch the strobe on, and set it to " + to;
}

}  // namespace emberlock::smear
