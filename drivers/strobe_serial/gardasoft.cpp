// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "drivers/strobe_serial/dialects.h"

// Gardasoft's RT and VTR lighting controllers (RT 20 user manual, section 12). Every reply ends with the
// prompt ">"; an error precedes it. The flash follows the internal trigger by 10 us to 999 ms; the shortest
// delay counts as phase 0.
namespace emberlock::drivers::strobe_serial {
namespace {

constexpr Seconds kShortestDelay = milliseconds(0.01), kLongestDelay = milliseconds(999);
constexpr Limits kGardasoftLimits{.device = "a Gardasoft controller",
                                  .narrowest = milliseconds(0.01),
                                  .widest = milliseconds(999),
                                  .steady = Limits::Steady::yes};

using Fields = std::map<std::string, std::string, std::less<>>;

/// Splits "CH 1, MD 1, S 50.0,0.0, DL 1.000ms" by keys; a second number after a comma belongs to the key
/// before it.
std::optional<Fields> fields_of(std::string_view reply) {
  Fields fields;
  for (const std::string_view part : split(reply, ',')) {
    const auto end = part.find_first_not_of("ABCDEFGHIJKLMNOPQRSTUVWXYZ");
    if (end == 0 && number_in(part, "%") && !fields.empty()) continue;
    if (end == 0 || end == std::string_view::npos) return std::nullopt;
    if (!fields.try_emplace(std::string(part.substr(0, end)), trim(part.substr(end))).second)
      return std::nullopt;
  }
  return fields;
}

/// A time as the device prints it; in milliseconds unless it has another unit.
std::optional<Seconds> time_in(std::string_view text) {
  if (const auto us = number_in(text, "us"); us && text.ends_with("us")) return microseconds(*us);
  if (const auto ms = number_in(text, "ms")) return milliseconds(*ms);
  if (const auto s = number_in(text, "s")) return Seconds(*s);
  return std::nullopt;
}

class Gardasoft final : public Dialect {
 public:
  explicit Gardasoft(const DialectOptions& options)
      : channel_(options.channel), brightness_(options.brightness) {}

  Framing framing() const override { return {.baud = 115200, .end = '>', .longest = 1024}; }
  std::string frame(std::string_view text, std::uint8_t /*number*/) const override {
    return std::string(text) + "\r";
  }
  /// An empty reply (only the prompt) is valid.
  Result<std::optional<std::string>> unframe(std::string_view line, std::uint8_t /*number*/) const override {
    return std::optional<std::string>(trim(line));
  }
  Command hello() const override { return {"VR", Answer::value}; }
  Result<std::string> model(std::string_view reply) const override {
    const std::string_view text = without_echo(reply, "VR");
    if (text.find("(HW") == std::string_view::npos || text.find(" V") == std::string_view::npos)
      return garbled(reply, "a model with its versions");
    return "Gardasoft " + std::string(text);
  }

  Result<std::vector<Command>> apply(const StrobeSettings& to,
                                     const std::optional<StrobeSettings>& now) const override {
    EMBERLOCK_RETURN_IF_ERROR(check(to, kGardasoftLimits));
    const Seconds delay = to.phase + kShortestDelay;
    if (delay > kLongestDelay) {
      return Error{ErrorKind::bad_input,
                   fmt::format("the phase is {} s", to.phase.value()),
                   {},
                   fmt::format("give at most {} s", (kLongestDelay - kShortestDelay).value())};
    }
    std::vector<Command> commands{{"GR", Answer::ignored}};  // clears earlier errors
    if (to.output == StrobeOutput::steady) {
      commands.push_back({fmt::format("RS{},{:.4g}", channel_, brightness_), Answer::status});
    } else {
      const Command pulse{fmt::format("RT{},{:.3f},{:.3f},{:.4g}", channel_, in_milliseconds(to.width),
                                      in_milliseconds(delay), brightness_),
                          Answer::status};
      // Off: no internal trigger; the period can't be set then.
      const Command rate{to.output == StrobeOutput::off
                             ? std::string("TT0")
                             : fmt::format("TT1,{:.3f}", in_milliseconds(period(to.rate))),
                         Answer::status};
      add_width_and_rate(commands, pulse, rate, to, now.value_or(StrobeSettings{.width = Seconds(1)}));
    }
    commands.push_back({"GR", Answer::status});
    return commands;
  }

  Status accepted(const Command& command, std::string_view reply) const override {
    const std::string_view text = without_echo(reply, command.text);
    if (text.empty()) return {};
    const auto refuse = [&](ErrorKind kind, const char* why) {
      return Error{kind,
                   fmt::format("it answers {} to {}: {}", text, command.text, why),
                   {},
                   "give what its manual allows for this light"};
    };
    if (text.starts_with("Evt")) return refuse(ErrorKind::device, "a fault of the light or of its supply");
    if (!text.starts_with("Err")) return garbled(reply, "the prompt alone");
    const auto code = number_in(trim(text.substr(3)));
    if (!code) return garbled(reply, "a number of an error");
    constexpr double kAdjusted = 5;  // a warning; settings() shows the adjusted value
    if (*code == kAdjusted) return {};
    if (*code == 1) return refuse(ErrorKind::bad_input, "a value is out of range");
    return refuse(ErrorKind::device, "the command isn't taken");
  }

  Rounding rounding(const StrobeSettings& to) const override {
    constexpr Seconds kStep = milliseconds(0.01);  // of the trigger period and the delay
    return {.rate = to.rate * (to.rate * kStep), .phase = kStep, .width = microseconds(1)};
  }

  std::optional<Command> question(std::span<const std::string> answers) const override {
    if (answers.empty()) return Command{"ST0", Answer::value};
    if (answers.size() == 1) return Command{fmt::format("ST{}", channel_), Answer::value};
    return std::nullopt;
  }

  Result<StrobeSettings> settings(std::span<const std::string> answers) const override {
    const auto general = fields_of(without_echo(answers[0], "ST0"));
    if (!general || !general->contains("TM") || !general->contains("TP"))
      return garbled(answers[0], "the trigger as TM and TP");
    const auto light = fields_of(without_echo(answers[1], fmt::format("ST{}", channel_)));
    if (!light) return garbled(answers[1], "a channel's settings");
    for (const char* key : {"CH", "MD", "S", "DL", "PU"}) {
      if (!light->contains(key)) return garbled(answers[1], fmt::format("a channel's settings with {}", key));
    }
    if (number_in(light->at("CH")) != channel_)
      return garbled(answers[1], fmt::format("channel {}", channel_));

    const auto trigger = number_in(general->at("TM")), mode = number_in(light->at("MD"));
    const auto brightness = number_in(light->at("S"), "%");
    const auto every = time_in(general->at("TP")), delay = time_in(light->at("DL")),
               width = time_in(light->at("PU"));
    if (!trigger || !mode || !brightness || !every || !delay || !width)
      return garbled(answers[0] + "; " + answers[1], "numbers");
    StrobeSettings s;
    constexpr double kContinuous = 0, kPulse = 1;
    if (*brightness == 0) {
      s.output = StrobeOutput::off;
    } else if (*mode == kContinuous) {
      s.output = StrobeOutput::steady;
    } else if (*mode == kPulse) {
      s.output = *trigger == 0 ? StrobeOutput::off : StrobeOutput::flashing;
    } else {
      return Error{ErrorKind::device, "its inputs switch the light", {}, "apply settings to it"};
    }
    if (*every > Seconds(0)) s.rate = rate(*every);
    if (*mode == kPulse) {
      if (!(*every > Seconds(0) && *width > Seconds(0))) return garbled(answers[0], "a period and a width");
      s.width = *width;
      s.phase = wrap_positive(*delay - kShortestDelay, *every);
    }
    return s;
  }

 private:
  static std::string_view without_echo(std::string_view reply, std::string_view command) {
    if (reply.starts_with(command)) reply.remove_prefix(command.size());
    return trim(reply);
  }

  int channel_;
  double brightness_;
};

}  // namespace

std::unique_ptr<const Dialect> make_gardasoft(const DialectOptions& options) {
  return std::make_unique<Gardasoft>(options);
}

}  // namespace emberlock::drivers::strobe_serial
