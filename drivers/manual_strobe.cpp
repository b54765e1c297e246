// SPDX-License-Identifier: Apache-2.0
#include "drivers/manual_strobe.h"

#include <utility>

#include <fmt/format.h>

namespace emberlock::drivers {

ManualStrobe::ManualStrobe(std::string id, const StrobeDial& dial) : id_(std::move(id)), dial_(dial) {}

Status ManualStrobe::apply(const StrobeSettings& settings) {
  const auto cannot = [&](std::string what) {
    return Error{ErrorKind::refused, std::move(what), "strobe " + id_, "Do it at the strobe itself"};
  };
  if (settings.output == StrobeOutput::off) return cannot("is set by hand: no program switches it off");
  if (settings.output == StrobeOutput::steady) return cannot("is set by hand: no program lets it shine");
  if (settings.phase != Seconds(0)) return cannot("is set by hand: no program moves its flashes");
  if (!settings.code.empty()) return cannot("is set by hand: no program skips its flashes");
  // Negated comparisons refuse NaN too.
  if (!(settings.rate >= dial_.slowest && settings.rate <= dial_.fastest)) {
    return Error{
        ErrorKind::bad_input, fmt::format("the rate is {} flashes a second", settings.rate.value()),
        "strobe " + id_,
        fmt::format("the dial goes from {:.4g} to {:.6g}", dial_.slowest.value(), dial_.fastest.value())};
  }
  asked_ = settings;
  asked_.rate = dial_.nearest(settings.rate);
  return {};
}

}  // namespace emberlock::drivers
