// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "drivers/strobe_serial/dialects.h"

// Pulse generators that trigger a strobe, by SCPI 1999 over IEEE 488.2. Uses the commands common to
// Keysight's 33500 and 81100 and Rigol's DG; levels and polarity stay as set on the front panel.
namespace emberlock::drivers::strobe_serial {
namespace {

constexpr Limits kScpiLimits{
    .device = "a pulse generator", .narrowest = nanoseconds(10), .widest = Seconds(2)};

Result<double> value(std::string_view reply, std::string_view what) {
  if (const auto number = number_in(reply)) return *number;
  return garbled(reply, what);
}

Result<StrobeOutput> output(std::string_view reply) {
  if (reply == "1" || reply == "ON") return StrobeOutput::flashing;
  if (reply == "0" || reply == "OFF") return StrobeOutput::off;
  return garbled(reply, "0 or 1");
}

class Scpi final : public Dialect {
 public:
  explicit Scpi(const DialectOptions& options)
      : phase_(options.phase),
        source_(fmt::format(":SOUR{}", options.channel)),
        output_(fmt::format(":OUTP{}", options.channel)) {}

  Framing framing() const override { return {.baud = 9600, .end = '\n', .longest = 256}; }
  std::string frame(std::string_view text, std::uint8_t /*number*/) const override {
    return std::string(text) + "\n";
  }
  Command hello() const override { return {"*IDN?", Answer::value}; }
  Result<std::string> model(std::string_view reply) const override { return identity(reply); }

  Result<std::vector<Command>> apply(const StrobeSettings& to,
                                     const std::optional<StrobeSettings>& now) const override {
    EMBERLOCK_RETURN_IF_ERROR(check(to, kScpiLimits));
    // Clears old errors from the queue.
    std::vector<Command> commands{{"*CLS"}};
    if (to.output == StrobeOutput::off) commands.push_back({output_ + " OFF"});
    commands.push_back({source_ + ":FUNC PULS"});
    const Command width{fmt::format("{}:FUNC:PULS:WIDT {:.12g}", source_, to.width.value())};
    const Command rate{fmt::format("{}:FREQ {:.12g}", source_, to.rate.value())};
    if (now) {
      add_width_and_rate(commands, width, rate, to, *now);
    } else {
      commands.push_back({source_ + ":FUNC:PULS:WIDT MIN"});
      commands.push_back(rate);
      commands.push_back(width);
    }
    commands.push_back({fmt::format("{}:PHAS {:.4f} DEG", source_, degrees(to))});
    if (to.output == StrobeOutput::flashing) commands.push_back({output_ + " ON"});
    commands.push_back({"SYST:ERR?", Answer::status});
    return commands;
  }

  Status accepted(const Command& command, std::string_view reply) const override {
    const auto fields = split(reply, ',');
    const auto code = number_in(fields.front());
    if (fields.size() != 2 || !code) return garbled(reply, "a number and text of an error");
    if (*code == 0) return {};
    constexpr std::string_view kRange = "-222";
    return Error{fields.front() == kRange ? ErrorKind::bad_input : ErrorKind::device,
                 fmt::format("it refuses the settings ({} says {})", command.text, reply),
                 {},
                 "give what its manual allows"};
  }

  /// Agilent's 81100 keeps four digits, the others at least six.
  Rounding rounding(const StrobeSettings& to) const override {
    const double digits = phase_ == ScpiPhase::delay ? 1e-3 : 1e-5;
    constexpr double kAngle = 0.1 / 360;
    return {.rate = std::max(Hertz(1e-6), to.rate * digits),
            .phase = period(to.rate) * std::max(kAngle, digits),
            .width = std::max(nanoseconds(10), to.width * digits)};
  }

  std::optional<Command> question(std::span<const std::string> answers) const override {
    const std::array<std::string, 5> all{source_ + ":FUNC?", source_ + ":FREQ?", source_ + ":FUNC:PULS:WIDT?",
                                         source_ + ":PHAS?", output_ + "?"};
    if (answers.size() >= all.size()) return std::nullopt;
    return Command{all[answers.size()], Answer::value};
  }

  Result<StrobeSettings> settings(std::span<const std::string> answers) const override {
    StrobeSettings s;
    EMBERLOCK_ASSIGN_OR_RETURN(const double rate, value(answers[1], "a frequency"));
    EMBERLOCK_ASSIGN_OR_RETURN(const double width, value(answers[2], "a pulse width"));
    EMBERLOCK_ASSIGN_OR_RETURN(const double angle, value(answers[3], "a phase"));
    EMBERLOCK_ASSIGN_OR_RETURN(s.output, output(answers[4]));
    if (!(rate > 0)) return garbled(answers[1], "a frequency");
    if (!(width > 0)) return garbled(answers[2], "a pulse width");
    const std::string& function = answers[0];
    if (function.empty() || !std::isalpha(static_cast<unsigned char>(function[0])))
      return garbled(function, "a function");
    if (s.output != StrobeOutput::off && function != "PULS" && function != "PULSE") {
      return Error{
          ErrorKind::device, "it gives out " + function + " and no pulses", {}, "apply settings to it"};
    }
    s.rate = Hertz(rate);
    s.width = Seconds(width);
    const double turns = phase_ == ScpiPhase::start ? -angle / 360 : angle / (2 * std::numbers::pi);
    s.phase = wrap_positive(turns, 1.0) * period(s.rate);
    return s;
  }

 private:
  [[nodiscard]] double degrees(const StrobeSettings& to) const {
    constexpr double kSteps = 1e4;  // per degree, as printed
    const double turns = to.phase / period(to.rate);
    const double steps = std::round((phase_ == ScpiPhase::start ? -turns : turns) * 360 * kSteps);
    return wrap_positive(steps, 360 * kSteps) / kSteps;
  }

  ScpiPhase phase_;
  std::string source_, output_;
};

}  // namespace

std::unique_ptr<const Dialect> make_scpi(const DialectOptions& options) {
  return std::make_unique<Scpi>(options);
}

}  // namespace emberlock::drivers::strobe_serial
