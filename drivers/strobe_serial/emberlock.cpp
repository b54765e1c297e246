// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>

#include "drivers/strobe_serial/controller/protocol.h"
#include "drivers/strobe_serial/dialects.h"

// Our own controller; see PROTOCOL.md for every line.
namespace emberlock::drivers::strobe_serial {
namespace {

namespace wire = emberlock_controller;

constexpr double kNanoseconds = 1e9;
constexpr std::size_t kBitsPerLine = 4 * wire::kCodeDigits;
constexpr Limits kControllerLimits{.device = "Emberlock's controller",
                                   .narrowest = microseconds(1),
                                   .widest = Seconds(2),
                                   .longest_code = wire::kLongestCode,
                                   .steady = Limits::Steady::yes};
constexpr std::array<std::string_view, 3> kOutputs{"off", "flash", "steady"};

/// Eight flashes per byte, the first in the highest bit; unused bits are 0.
std::string packed(const std::vector<bool>& code) {
  std::string bytes((code.size() + 7) / 8, '\0');
  for (std::size_t i = 0; i < code.size(); ++i) {
    if (code[i]) bytes[i / 8] = static_cast<char>(bytes[i / 8] | 0x80 >> i % 8);
  }
  return bytes;
}

struct Report {
  StrobeOutput output = StrobeOutput::off;
  std::uint64_t period = 0, phase = 0, width = 0, length = 0, sum = 0;
};

std::optional<std::uint64_t> whole(std::string_view text) {
  constexpr std::size_t kDigits = 10;
  const auto number = text.size() <= kDigits ? number_in(text) : std::nullopt;
  if (!number || text.find_first_not_of("0123456789") != std::string_view::npos) return std::nullopt;
  return static_cast<std::uint64_t>(*number);
}

/// "ok flash per=41708375 pha=0 wid=20000 len=0 sum=65535 dog=0 n=17 bad=0".
std::optional<Report> report(std::string_view answer) {
  const auto words = split(answer, ' ');
  constexpr std::array<std::string_view, 8> kFields{
      "per=", "pha=", "wid=", "len=", "sum=", "dog=", "n=", "bad="};
  if (words.size() != kFields.size() + 2 || words[0] != "ok") return std::nullopt;
  const auto output = std::find(kOutputs.begin(), kOutputs.end(), words[1]);
  if (output == kOutputs.end()) return std::nullopt;
  std::array<std::uint64_t, kFields.size()> values{};
  for (std::size_t i = 0; i < kFields.size(); ++i) {
    const std::string_view word = words[i + 2];
    const auto value = word.starts_with(kFields[i]) ? whole(word.substr(kFields[i].size())) : std::nullopt;
    if (!value) return std::nullopt;
    values[i] = *value;
  }
  const auto& [per, pha, wid, len, sum, dog, flashes, bad] = values;
  if (per < wire::kShortestPeriod || per > wire::kLongestPeriod || pha >= per || wid == 0 || wid >= per ||
      len > wire::kLongestCode)
    return std::nullopt;
  return Report{static_cast<StrobeOutput>(output - kOutputs.begin()), per, pha, wid, len, sum};
}

/// The packed code from the replies to "bits".
std::optional<std::string> bits(std::span<const std::string> answers, std::size_t length) {
  std::string bytes;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    const auto words = split(answers[i], ' ');
    if (words.size() != 3 || words[0] != "ok" || whole(words[1]) != i * kBitsPerLine) return std::nullopt;
    const std::string_view digits = words[2];
    if (digits.size() % 2 != 0) return std::nullopt;
    for (std::size_t d = 0; d < digits.size(); d += 2) {
      const auto high = wire::hex_value(digits[d]), low = wire::hex_value(digits[d + 1]);
      if (high > 15 || low > 15) return std::nullopt;
      bytes += static_cast<char>(high << 4 | low);
    }
  }
  const std::size_t size = (length + 7) / 8;
  if (bytes.size() < size) return std::nullopt;
  bytes.resize(size);
  return bytes;
}

class Controller final : public Dialect {
 public:
  explicit Controller(const DialectOptions& options) : dog_(options.watchdog) {}

  Framing framing() const override {
    return {.baud = 115200, .end = '\n', .longest = wire::kLongestLine + 1, .numbered = true};
  }
  std::string frame(std::string_view text, std::uint8_t number) const override {
    const std::string line = fmt::format(":{:02X} {}", number, text);
    return fmt::format("{}*{:04X}\n", line, wire::crc16(line.data(), line.size()));
  }
  Result<std::optional<std::string>> unframe(std::string_view line, std::uint8_t number) const override {
    line = trim(line);
    constexpr std::size_t kHead = 4, kTail = 5;  // "=NN " and "*CCCC"
    if (line.size() < kHead + kTail || line[0] != '=' || line[3] != ' ' || line[line.size() - kTail] != '*')
      return garbled(line, "a line of our protocol");
    const std::string_view body = line.substr(0, line.size() - kTail);
    if (line.substr(line.size() - kTail + 1) != fmt::format("{:04X}", wire::crc16(body.data(), body.size())))
      return garbled(line, "a line whose checksum is right");
    if (body.substr(1, 2) != fmt::format("{:02X}", number)) return std::optional<std::string>();
    return std::optional<std::string>(body.substr(kHead));
  }

  Command hello() const override { return {"hi", Answer::value}; }
  Result<std::string> model(std::string_view reply) const override {
    const auto words = split(reply, ' ');
    if (words.size() < 5 || words[0] != "ok" || words[1] != "emberlock")
      return garbled(reply, "an Emberlock controller's greeting");
    if (whole(words[2]) != wire::kVersion) {
      return Error{ErrorKind::device,
                   fmt::format("the controller speaks version {} of the protocol", words[2]),
                   {},
                   fmt::format("give it the sketch of version {}", wire::kVersion)};
    }
    return fmt::format("Emberlock {} {}", words[3], words[4]);
  }

  Result<std::vector<Command>> apply(const StrobeSettings& to,
                                     const std::optional<StrobeSettings>& now) const override {
    EMBERLOCK_RETURN_IF_ERROR(check(to, kControllerLimits));
    std::vector<Command> commands;
    const std::string code = packed(to.code);
    if (!now || now->code != to.code) {
      for (std::size_t from = 0; from < code.size(); from += kBitsPerLine / 8) {
        std::string line = fmt::format("code {} ", from * 8);
        for (const char byte : code.substr(from, kBitsPerLine / 8))
          line += fmt::format("{:02X}", static_cast<unsigned char>(byte));
        commands.push_back({std::move(line), Answer::status});
      }
    }
    const double per = std::round(kNanoseconds / to.rate.value());
    const double pha = std::min(std::round(to.phase.value() * kNanoseconds), per - 1);
    const double wid = std::min(std::round(to.width.value() * kNanoseconds), per - 1);
    commands.push_back(
        {fmt::format("set {} per={} pha={} wid={} len={} sum={} dog={}",
                     kOutputs[static_cast<std::size_t>(to.output)], per, pha, wid, to.code.size(),
                     wire::crc16(code.data(), code.size()), std::round(in_milliseconds(dog_))),
         Answer::status});
    return commands;
  }

  Status accepted(const Command& command, std::string_view reply) const override {
    const auto words = split(reply, ' ');
    if (words[0] == "ok") return {};
    if (words[0] != "err" || words.size() < 3) return garbled(reply, "ok or an error");
    if (words[1] == "3" && words.size() == 5) {
      return Error{ErrorKind::bad_input,
                   fmt::format("the controller can't do this {}: {}", words[2], command.text),
                   {},
                   fmt::format("give {} to {}", words[3], words[4])};
    }
    return Error{ErrorKind::device,
                 fmt::format("the controller refuses {} with \"{}\"", command.text, reply),
                 {},
                 "apply the settings again"};
  }

  /// 1 ns for the period, a tick for the rest.
  Rounding rounding(const StrobeSettings& to) const override {
    constexpr Seconds kLongestTick = microseconds(1);
    return {.rate = to.rate * (to.rate * nanoseconds(1)), .phase = kLongestTick, .width = kLongestTick};
  }

  std::optional<Command> question(std::span<const std::string> answers) const override {
    if (answers.empty()) return Command{"get", Answer::value};
    const auto told = report(answers[0]);
    const std::size_t next = (answers.size() - 1) * kBitsPerLine;
    if (!told || next >= told->length) return std::nullopt;
    return Command{fmt::format("bits {}", next), Answer::value};
  }

  Result<StrobeSettings> settings(std::span<const std::string> answers) const override {
    const auto told = report(answers[0]);
    if (!told) return garbled(answers[0], "the controller's settings");
    StrobeSettings s{.output = told->output,
                     .rate = Hertz(kNanoseconds / static_cast<double>(told->period)),
                     .phase = nanoseconds(static_cast<double>(told->phase)),
                     .width = nanoseconds(static_cast<double>(told->width))};
    const auto code = bits(answers.subspan(1), told->length);
    if (!code || wire::crc16(code->data(), code->size()) != told->sum)
      return garbled(answers.back(), "the code of skipped flashes");
    s.code.resize(told->length);
    for (std::size_t i = 0; i < s.code.size(); ++i) s.code[i] = ((*code)[i / 8] << i % 8 & 0x80) != 0;
    return s;
  }

 private:
  Seconds dog_;
};

}  // namespace

std::unique_ptr<const Dialect> make_controller(const DialectOptions& options) {
  return std::make_unique<Controller>(options);
}

}  // namespace emberlock::drivers::strobe_serial
