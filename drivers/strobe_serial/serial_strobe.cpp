// SPDX-License-Identifier: Apache-2.0
#include "drivers/strobe_serial/serial_strobe.h"

#include <algorithm>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/log.h"

namespace emberlock::drivers {
namespace {

constexpr Seconds kCall(4);        // a code of 4096 flashes, sent and read back at 115200 baud, takes 1 s
constexpr Seconds kGreeting(0.8);  // time within which a device that was running replies

/// Error device: the settings differ from the request by more than the device's steps.
Status verify(const StrobeSettings& told, const StrobeSettings& asked, const Rounding& rounding) {
  const auto refuse = [](std::string what, const char* remedy) {
    return Error{ErrorKind::device, "it took the settings, but " + std::move(what), {}, remedy};
  };
  constexpr const char* kPanel = "look at its front panel, interlock and keys";
  if (told.code != asked.code) return refuse("plays another code", kPanel);
  if (told.output != asked.output) return refuse("its light isn't as asked for", kPanel);
  if (asked.output != StrobeOutput::flashing) return {};

  const auto differs = [&](std::string_view what, double wanted, double is, std::string_view unit) {
    return refuse(
        fmt::format("says that its {} is {:.9g} {}, asked for {:.9g} {}", what, is, unit, wanted, unit),
        "ask for what it can do, or lift the limit on its front panel");
  };
  constexpr double kDecimals = 1 + 1e-9;  // allows a full step in spite of floating-point rounding
  if (abs(told.rate - asked.rate) > rounding.rate * kDecimals)
    return differs("rate", asked.rate.value(), told.rate.value(), "flashes a second");
  if (abs(told.width - asked.width) > rounding.width * kDecimals)
    return differs("flash width", asked.width.value(), told.width.value(), "s");
  // A phase near the end of the period shifts with it, and may wrap.
  const Seconds every = period(told.rate);
  const Seconds late = abs(wrap_symmetric(told.phase - asked.phase, every));
  if (late > rounding.phase * kDecimals + abs(every - period(asked.rate)) + Seconds(1e-12))
    return differs("phase", asked.phase.value(), told.phase.value(), "s");
  return {};
}

}  // namespace

SerialStrobe::SerialStrobe(std::string id, std::unique_ptr<const Dialect> dialect, Opener open,
                           std::shared_ptr<Clock> clock)
    : id_(std::move(id)), dialect_(std::move(dialect)), open_(std::move(open)), clock_(std::move(clock)) {}

Error SerialStrobe::named(Error error) const {
  error.where = "strobe " + id_;
  return error;
}

Status SerialStrobe::ready(TimePoint until) {
  if (!line_) {
    EMBERLOCK_ASSIGN_OR_RETURN(auto wire, open_());
    line_.emplace(std::move(wire), *dialect_, *clock_);
  }
  if (line_->in_step()) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string model,
                             line_->greet(std::min(until, clock_->now() + kGreeting)));
  log(LogCategory::drivers).debug("{}: {} answers", id_, model);
  return {};
}

template <class Call>
auto SerialStrobe::with_device(const Call& call) -> decltype(call(TimePoint())) {
  const TimePoint until = clock_->now() + kCall;
  const auto attempt = [&]() -> decltype(call(until)) {
    EMBERLOCK_RETURN_IF_ERROR(ready(until));
    auto made = call(until);
    // A senseless reply may belong to another command.
    if (!made.ok() && made.error().kind != ErrorKind::bad_input) line_->doubt();
    return made;
  };
  auto result = attempt();
  const bool again = !result.ok() && result.error().kind != ErrorKind::bad_input && line_ && !line_->lost();
  if (again) result = attempt();
  if (line_ && line_->lost()) line_.reset();
  if (!result.ok()) return named(result.error());
  return result;
}

Result<std::string> SerialStrobe::greet(Seconds patience) {
  if (!line_) {
    auto wire = open_();
    if (!wire) return named(wire.error());
    line_.emplace(std::move(*wire), *dialect_, *clock_);
  }
  auto model = line_->greet(clock_->now() + patience);
  if (line_->lost()) line_.reset();
  if (!model) return named(model.error());
  return model;
}

Result<StrobeSettings> SerialStrobe::settings(TimePoint until) {
  std::vector<std::string> answers;
  while (const auto question = dialect_->question(answers)) {
    EMBERLOCK_ASSIGN_OR_RETURN(std::string answer, line_->ask(*question, until));
    answers.push_back(std::move(answer));
  }
  return dialect_->settings(answers);
}

Result<StrobeSettings> SerialStrobe::read_back() {
  return with_device([&](TimePoint until) { return settings(until); });
}

Status SerialStrobe::apply(const StrobeSettings& to) {
  // Invalid settings are refused before anything is sent.
  if (const auto possible = dialect_->apply(to, std::nullopt); !possible) return named(possible.error());
  return with_device([&](TimePoint until) -> Status {
    std::optional<StrobeSettings> now;
    if (auto told = settings(until)) {
      now = std::move(*told);
    } else if (!line_->in_step()) {
      return told.error();
    }
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<Command> commands, dialect_->apply(to, now));
    for (const Command& command : commands) {
      EMBERLOCK_ASSIGN_OR_RETURN(const std::string answer, line_->ask(command, until));
      if (command.answer == Answer::status) {
        EMBERLOCK_RETURN_IF_ERROR(dialect_->accepted(command, answer));
      }
    }
    // Its reply proves that all commands have taken effect.
    EMBERLOCK_ASSIGN_OR_RETURN(const StrobeSettings after, settings(until));
    return verify(after, to, dialect_->rounding(to));
  });
}

}  // namespace emberlock::drivers
