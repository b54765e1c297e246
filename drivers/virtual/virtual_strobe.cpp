// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/virtual_strobe.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/log.h"

namespace emberlock::drivers {
namespace {

constexpr Hertz kSlowest{30.0 / 60};
constexpr Hertz kFastest{20000.0 / 60};
constexpr std::size_t kLongestCode = 4096;

}  // namespace

Status check_settings(const StrobeSettings& s, const std::string& where) {
  const auto refuse = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), where, std::move(remedy)};
  };
  // Negated comparisons refuse NaN too.
  if (!(s.rate >= kSlowest && s.rate <= kFastest)) {
    return refuse(fmt::format("the rate is {} flashes a second", s.rate.value()), "give 0.5 to 333.33");
  }
  const Seconds longest = period(s.rate);
  if (!(s.phase >= Seconds(0) && s.phase < longest)) {
    return refuse(fmt::format("the phase is {} s", s.phase.value()),
                  fmt::format("give at least 0 and less than {} s", longest.value()));
  }
  if (!(s.width > Seconds(0) && s.width < longest)) {
    return refuse(fmt::format("the flash width is {} s", s.width.value()),
                  fmt::format("give more than 0 and less than {} s", longest.value()));
  }
  if (s.code.size() > kLongestCode) {
    return refuse(fmt::format("the code has {} flashes", s.code.size()),
                  fmt::format("give at most {}", kLongestCode));
  }
  return {};
}

VirtualStrobe::VirtualStrobe(VirtualStrobeOptions options, std::shared_ptr<Clock> clock,
                             std::shared_ptr<StrobeTimeline> timeline, std::unique_ptr<LightWriter> light)
    : options_(std::move(options)),
      clock_(std::move(clock)),
      timeline_(std::move(timeline)),
      light_(std::move(light)) {}

Status VirtualStrobe::apply(const StrobeSettings& settings) {
  EMBERLOCK_RETURN_IF_ERROR(check_settings(settings, "strobe " + options_.id));
  StrobeSettings rounded = settings;
  // Dividing by the number of steps per second, an integer, keeps multiples of a step exact.
  const double rate_steps = std::round(1 / options_.rate_step.value());
  const double time_steps = std::round(1 / options_.time_step.value());
  rounded.rate = Hertz(std::round(settings.rate.value() * rate_steps) / rate_steps);
  const double below_period = std::ceil(time_steps / rounded.rate.value()) - 1;
  rounded.phase =
      Seconds(std::min(std::round(settings.phase.value() * time_steps), below_period) / time_steps);
  rounded.width =
      Seconds(std::clamp(std::round(settings.width.value() * time_steps), 1.0, below_period) / time_steps);
  TimePoint at = clock_->now();
  if (light_) {
    EMBERLOCK_ASSIGN_OR_RETURN(at, light_->announce(rounded));
  }
  settings_ = std::move(rounded);
  timeline_->apply(settings_, at);
  clock_->sleep_until(at);
  log(LogCategory::drivers).debug("{}: {} flashes a second", options_.id, settings_.rate.value());
  return {};
}

}  // namespace emberlock::drivers
