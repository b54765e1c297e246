// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "drivers/strobe_serial/dialects.h"

// Schott's ColdVision light source, legacy protocol (CV-LS programming guide D20980.026): "&RF24" sets,
// "&RF?" queries, both return "&rf24". Continuous strobe has whole Hertz, widths in thousandths of the period
// and no delay; &PD delays only externally triggered flashes.
namespace emberlock::drivers::strobe_serial {
namespace {

constexpr double kDutySteps = 1000;
constexpr Limits kSchottLimits{.device = "a Schott light source",
                               .slowest = Hertz(6),
                               .narrowest = microseconds(1),
                               .widest = Seconds(1),
                               .steady = Limits::Steady::yes};

class Schott final : public Dialect {
 public:
  explicit Schott(const DialectOptions& options) : channel_(options.channel) {}

  Framing framing() const override { return {.baud = 9600, .end = '\r', .longest = 80}; }
  std::string frame(std::string_view text, std::uint8_t /*number*/) const override {
    return std::string(text) + "\r";
  }
  Command hello() const override { return {"&Q", Answer::value}; }
  Result<std::string> model(std::string_view reply) const override {
    if (!reply.starts_with("&qSCHOTT")) return garbled(reply, "a Schott's name");
    return std::string(reply.substr(2));
  }

  Result<std::vector<Command>> apply(const StrobeSettings& to,
                                     const std::optional<StrobeSettings>& /*now*/) const override {
    EMBERLOCK_RETURN_IF_ERROR(check(to, kSchottLimits));
    if (to.phase != Seconds(0)) {
      return Error{ErrorKind::bad_input,
                   fmt::format("the phase is {} s", to.phase.value()),
                   {},
                   "give 0: a Schott light source delays triggered flashes alone"};
    }
    const double rate = std::round(to.rate.value());
    const double duty = std::clamp(std::round(to.width.value() * rate * kDutySteps), 1.0, kDutySteps - 1);
    std::vector<Command> commands;
    const auto say = [&](std::string text) { commands.push_back({std::move(text), Answer::status}); };
    if (to.output == StrobeOutput::off) say(fmt::format("&L{},0", channel_));
    say("&PM0");
    say(fmt::format("&RF{}", rate));
    say(fmt::format("&RD{},{}", channel_, duty));
    say(to.output == StrobeOutput::steady ? "&RM0" : "&RM1");
    if (to.output != StrobeOutput::off) say(fmt::format("&L{},1", channel_));
    return commands;
  }

  Status accepted(const Command& command, std::string_view reply) const override {
    if (reply.starts_with("&n")) {
      return Error{ErrorKind::device,
                   fmt::format("it refuses {} with {}", command.text, reply),
                   {},
                   "give what its manual allows"};
    }
    // The reply contains the accepted value, which read_back will check; here only its kind matters.
    const auto letters = command.text.find_first_of("0123456789");
    if (!reply.starts_with(lower(command.text.substr(0, letters))))
      return garbled(reply, lower(command.text));
    return {};
  }

  /// Whole Hertz, and thousandths of the resulting period.
  Rounding rounding(const StrobeSettings& to) const override {
    const Seconds every = period(Hertz(std::round(to.rate.value())));
    return {.rate = Hertz(0.5), .phase = Seconds(0), .width = every * (1 / kDutySteps)};
  }

  std::optional<Command> question(std::span<const std::string> answers) const override {
    if (answers.size() >= kQuestions) return std::nullopt;
    return Command{questions()[answers.size()] + "?", Answer::value};
  }

  Result<StrobeSettings> settings(std::span<const std::string> answers) const override {
    std::array<double, kQuestions> values{};
    for (std::size_t i = 0; i < kQuestions; ++i) {
      const std::string head = lower(questions()[i]);
      const std::string& answer = answers[i];
      if (!answer.starts_with(head)) return garbled(answer, head + "...");
      const auto value = number_in(std::string_view(answer).substr(head.size()));
      if (!value || *value < 0) return garbled(answer, head + " and a number");
      values[i] = *value;
    }
    const auto [light, triggered, strobing, rate, duty] = values;
    StrobeSettings s;
    if (light == 0) {
      s.output = StrobeOutput::off;
    } else if (triggered != 0) {
      return Error{ErrorKind::device, "it waits for triggers from elsewhere", {}, "apply settings to it"};
    } else {
      s.output = strobing != 0 ? StrobeOutput::flashing : StrobeOutput::steady;
    }
    if (!(rate > 0)) return garbled(answers[3], "a frequency");
    s.rate = Hertz(rate);
    s.width = period(s.rate) * (duty / kDutySteps);
    if (s.output == StrobeOutput::flashing && duty == 0) s.output = StrobeOutput::off;
    return s;
  }

 private:
  static constexpr std::size_t kQuestions = 5;
  [[nodiscard]] std::array<std::string, kQuestions> questions() const {
    return {fmt::format("&L{},", channel_), "&PM", "&RM", "&RF", fmt::format("&RD{},", channel_)};
  }
  static std::string lower(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
    return text;
  }

  int channel_;
};

}  // namespace

std::unique_ptr<const Dialect> make_schott(const DialectOptions& options) {
  return std::make_unique<Schott>(options);
}

}  // namespace emberlock::drivers::strobe_serial
