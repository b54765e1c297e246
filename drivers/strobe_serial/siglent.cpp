// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>
#include <map>

#include <fmt/format.h>

#include "drivers/strobe_serial/dialects.h"

// Siglent's SDG generators without a SCPI tree (SDG programming guide, BSWV and OUTP). Pulses have no PHSE,
// but a delay in seconds. They report no errors and clip values; the accepted values are read back.
namespace emberlock::drivers::strobe_serial {
namespace {

constexpr Limits kSiglentLimits{
    .device = "a pulse generator", .narrowest = nanoseconds(100), .widest = Seconds(2)};

class Siglent final : public Dialect {
 public:
  explicit Siglent(const DialectOptions& options) : channel_(fmt::format("C{}:", options.channel)) {}

  Framing framing() const override { return {.baud = 9600, .end = '\n', .longest = 512}; }
  std::string frame(std::string_view text, std::uint8_t /*number*/) const override {
    return std::string(text) + "\n";
  }
  Command hello() const override { return {"*IDN?", Answer::value}; }
  Result<std::string> model(std::string_view reply) const override {
    EMBERLOCK_ASSIGN_OR_RETURN(std::string who, identity(reply));
    std::string lower = who;
    std::transform(lower.begin(), lower.end(), lower.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    if (!lower.starts_with("siglent")) return garbled(reply, "a Siglent's identity");
    return who;
  }

  Result<std::vector<Command>> apply(const StrobeSettings& to,
                                     const std::optional<StrobeSettings>& /*now*/) const override {
    EMBERLOCK_RETURN_IF_ERROR(check(to, kSiglentLimits));
    const std::string pulse = fmt::format("WIDTH,{:.9g},DLY,{:.9g}", to.width.value(), to.phase.value());
    std::vector<Command> commands;
    if (to.output == StrobeOutput::off) commands.push_back({channel_ + "OUTP OFF"});
    commands.push_back({fmt::format("{}BSWV WVTP,PULSE,FRQ,{:.12g},{}", channel_, to.rate.value(), pulse)});
    // Repeated after the new period is set, because the old period may have clipped the values.
    commands.push_back({fmt::format("{}BSWV {}", channel_, pulse)});
    if (to.output == StrobeOutput::flashing) commands.push_back({channel_ + "OUTP ON"});
    return commands;
  }

  Status accepted(const Command& command, std::string_view reply) const override {
    return garbled(reply, "nothing to " + command.text);
  }

  /// It prints at least six digits.
  Rounding rounding(const StrobeSettings& to) const override {
    constexpr double kDigits = 1e-5;
    return {.rate = std::max(Hertz(1e-6), to.rate * kDigits),
            .phase = std::max(nanoseconds(10), to.phase * kDigits),
            .width = std::max(nanoseconds(10), to.width * kDigits)};
  }

  std::optional<Command> question(std::span<const std::string> answers) const override {
    if (answers.empty()) return Command{channel_ + "BSWV?", Answer::value};
    if (answers.size() == 1) return Command{channel_ + "OUTP?", Answer::value};
    return std::nullopt;
  }

  Result<StrobeSettings> settings(std::span<const std::string> answers) const override {
    StrobeSettings s;
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string_view state, body(answers[1], "OUTP "));
    const std::string_view on = split(state, ',').front();
    if (on != "ON" && on != "OFF") return garbled(answers[1], "ON or OFF");
    s.output = on == "ON" ? StrobeOutput::flashing : StrobeOutput::off;

    EMBERLOCK_ASSIGN_OR_RETURN(const auto wave, parameters(answers[0]));
    const auto type = wave.find("WVTP");
    if (type == wave.end()) return garbled(answers[0], "a waveform");
    if (type->second != "PULSE") {
      if (s.output == StrobeOutput::off) return s;
      return Error{ErrorKind::device,
                   fmt::format("it gives out {} and no pulses", type->second),
                   {},
                   "apply settings to it"};
    }
    const auto number = [&, &wave = wave](const char* key, const char* unit) -> std::optional<double> {
      const auto found = wave.find(key);
      return found == wave.end() ? std::nullopt : number_in(found->second, unit);
    };
    const auto rate = number("FRQ", "HZ"), width = number("WIDTH", "S"), delay = number("DLY", "S");
    if (!rate || !width || !delay || !(*rate > 0 && *width > 0))
      return garbled(answers[0], "a pulse's FRQ, WIDTH and DLY");
    s.rate = Hertz(*rate);
    s.width = Seconds(*width);
    s.phase = wrap_positive(Seconds(*delay), period(s.rate));
    return s;
  }

 private:
  /// The text after "C1:" and the command's name; with CHDR SHORT replies consist of that text alone.
  [[nodiscard]] Result<std::string_view> body(std::string_view reply, std::string_view command) const {
    const std::string head = channel_ + std::string(command);
    if (!reply.starts_with(head)) return garbled(reply, head + "...");
    return reply.substr(head.size());
  }
  [[nodiscard]] Result<std::map<std::string, std::string, std::less<>>> parameters(
      std::string_view reply) const {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::string_view text, body(reply, "BSWV "));
    const auto fields = split(text, ',');
    std::map<std::string, std::string, std::less<>> found;
    for (std::size_t i = 0; i + 1 < fields.size(); i += 2) {
      if (!found.try_emplace(std::string(fields[i]), fields[i + 1]).second)
        return garbled(reply, "each parameter once");
    }
    if (fields.size() % 2 != 0) return garbled(reply, "pairs of parameter and value");
    return found;
  }

  std::string channel_;
};

}  // namespace

std::unique_ptr<const Dialect> make_siglent(const DialectOptions& options) {
  return std::make_unique<Siglent>(options);
}

}  // namespace emberlock::drivers::strobe_serial
