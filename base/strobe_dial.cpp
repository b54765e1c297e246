// SPDX-License-Identifier: Apache-2.0
#include "base/strobe_dial.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace emberlock {
namespace {

constexpr double kWidestStep = 100;  // flashes a minute
constexpr int kMostDigits = 4;

}  // namespace

Hertz StrobeDial::nearest(Hertz rate) const {
  // The dial steps in flashes per minute: a step of 0.1 is a tenth of a flash per minute, not per second.
  const double steps_a_flash = 1 / (60 * step.value());
  const double steps = std::round(60 * rate.value() * steps_a_flash);
  return std::clamp(Hertz(steps / steps_a_flash / 60), slowest, fastest);
}

std::string StrobeDial::per_minute(Hertz rate) const {
  const double digits = std::ceil(-std::log10(60 * step.value()) - 1e-6);
  return fmt::format("{:.{}f}", 60 * rate.value(),
                     static_cast<int>(std::clamp<double>(digits, 0, kMostDigits)));
}

Status check(const StrobeDial& dial) {
  const double step = 60 * dial.step.value();
  if (!(step > 0 && step <= kWidestStep * (1 + 1e-9))) {
    return Error{ErrorKind::bad_input, fmt::format("the dial's step is {} flashes a minute", step), "strobe",
                 fmt::format("give more than 0 and at most {}", kWidestStep)};
  }
  if (!(dial.slowest > Hertz(0) && dial.slowest < dial.fastest)) {
    return Error{ErrorKind::bad_input, "the dial's range is empty", "strobe",
                 "give its slowest and its fastest rate"};
  }
  return {};
}

}  // namespace emberlock
