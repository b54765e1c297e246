// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/dial_words.h"

#include <cmath>

#include <fmt/format.h>

namespace emberlock::smear {
namespace {

/// "1438.6 flashes a minute (23.977 Hz)"
std::string setting(Hertz rate, const StrobeDial& dial) {
  return fmt::format("{} flashes a minute ({:.3f} Hz)", dial.per_minute(rate), rate.value());
}

/// "turn it down by 71.9 (4.76 %), to 1438.6 flashes a minute (23.977 Hz)"
std::string turning(Hertz from, Hertz to, const StrobeDial& dial) {
  const double percent = 100 * std::abs(to / from - 1);
  return fmt::format("turn it {} by {} ({:.{}f} %), to {}", to > from ? "up" : "down",
                     dial.per_minute(to > from ? to - from : from - to), percent, percent < 10 ? 2 : 0,
                     setting(to, dial));
}

/// Names the other rates that would show the same; empty where there are none.
std::string or_else(const std::vector<Hertz>& others, const StrobeDial& dial) {
  if (others.empty()) return {};
  std::string rates;
  for (const Hertz other : others) rates += (rates.empty() ? "" : ", ") + dial.per_minute(other);
  return " (or at " + rates + ", if all the flashes between fall where no camera shows them)";
}

/// Of flashes that are too far off to be followed, or not seen at all.
std::string what_to_do(const DialAdvice& advice, const StrobeDial& dial) {
  const std::string to = setting(advice.set, dial);
  const Hertz measured = advice.measured.value_or(advice.set);
  switch (advice.seen) {
    case FlashesSeen::rate:
      return "the strobe flashes at " + dial.per_minute(measured) + " a minute" +
             or_else(advice.others, dial) + ": " + turning(measured, advice.set, dial);
    case FlashesSeen::hidden:
      return "every flash falls where no camera shows it: turn the strobe a little, to " + to;
    case FlashesSeen::too_slow:
      return fmt::format("the strobe flashes at less than {:.0f} a minute: turn it up, to ",
                         60 * advice.slower_than.value_or(Hertz(0)).value()) +
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

}  // namespace

std::string dial_words(const AlignDecision& decision, const std::vector<AlignCamera>& cameras,
                       const AlignOptions& options) {
  if (!decision.dial || !options.dial) return {};
  const DialAdvice& advice = *decision.dial;
  const StrobeDial& dial = *options.dial;
  const Hertz measured = advice.measured.value_or(advice.set);
  switch (advice.cause) {
    case DialCause::set:
      break;
    case DialCause::leave:
      return "the strobe flashes at " + dial.per_minute(measured) + " a minute, set to " +
             dial.per_minute(advice.set) + ": leave it";
    case DialCause::out_of_sight:
      return "the strobe, set to " + dial.per_minute(advice.set) + " a minute, is out of sight for now";
    case DialCause::turn_off_rate: {
      std::string hidden;
      for (const std::size_t i : advice.hidden) hidden += (hidden.empty() ? "" : ", ") + cameras[i].id;
      return "the flashes stand nearly still in the frames: " +
             turning(advice.from.value_or(measured), advice.set, dial) +
             (hidden.empty() ? ", so that dots are seen to follow them"
                             : ", so that the dot of " + hidden + " walks into sight");
    }
  }
  return what_to_do(advice, dial);
}

}  // namespace emberlock::smear
