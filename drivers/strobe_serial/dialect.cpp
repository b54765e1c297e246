// SPDX-License-Identifier: Apache-2.0
#include "drivers/strobe_serial/dialect.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "drivers/strobe_serial/dialects.h"

namespace emberlock::drivers {
namespace {

struct Entry {
  StrobeDialect dialect;
  std::string_view name;
  int channels;
  std::unique_ptr<const Dialect> (*make)(const DialectOptions&);
};

constexpr std::array kEntries{
    Entry{StrobeDialect::emberlock, "emberlock", 1, strobe_serial::make_controller},
    Entry{StrobeDialect::scpi, "scpi", 2, strobe_serial::make_scpi},
    Entry{StrobeDialect::siglent_bswv, "siglent-bswv", 2, strobe_serial::make_siglent},
    Entry{StrobeDialect::gardasoft_rt, "gardasoft-rt", 8, strobe_serial::make_gardasoft},
    Entry{StrobeDialect::schott_cv_ls, "schott-cv-ls", 4, strobe_serial::make_schott},
};

const Entry& entry(StrobeDialect dialect) { return kEntries[static_cast<std::size_t>(dialect)]; }

}  // namespace

std::string_view name_of(StrobeDialect dialect) { return entry(dialect).name; }

Result<StrobeDialect> parse_strobe_dialect(std::string_view name) {
  const auto* found =
      std::find_if(kEntries.begin(), kEntries.end(), [&](const Entry& e) { return e.name == name; });
  if (found != kEntries.end()) return found->dialect;
  std::string names;
  for (const Entry& e : kEntries) names += fmt::format("{}{}", names.empty() ? "" : ", ", e.name);
  return Error{ErrorKind::bad_input, fmt::format("no dialect \"{}\"", name), "strobe",
               "give one of " + names};
}

Result<std::unique_ptr<const Dialect>> make_dialect(StrobeDialect dialect, const DialectOptions& o) {
  const auto refuse = [](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), "strobe", std::move(remedy)};
  };
  const Entry& e = entry(dialect);
  if (o.channel < 1 || o.channel > e.channels) {
    return refuse(fmt::format("channel is {}", o.channel),
                  e.channels == 1 ? "give 1" : fmt::format("give 1 to {}", e.channels));
  }
  if (!(o.brightness > 0 && o.brightness <= 100))
    return refuse(fmt::format("brightness is {} %", o.brightness), "give more than 0 and at most 100");
  if (o.watchdog != Seconds(0) && !(o.watchdog >= Seconds(0.1) && o.watchdog <= Seconds(600)))
    return refuse(fmt::format("watchdog is {} s", o.watchdog.value()), "give 0 (none) or 0.1 to 600");
  return e.make(o);
}

Result<std::optional<std::string>> Dialect::unframe(std::string_view line, std::uint8_t /*number*/) const {
  const std::string_view text = strobe_serial::trim(line);
  if (text.empty()) return std::optional<std::string>();
  return std::optional<std::string>(text);
}

namespace strobe_serial {

Status check(const StrobeSettings& s, const Limits& limits) {
  const auto refuse = [](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), {}, std::move(remedy)};
  };
  // Negated comparisons refuse NaN too.
  if (!(s.rate >= limits.slowest && s.rate <= limits.fastest)) {
    return refuse(fmt::format("the rate is {} flashes a second", s.rate.value()),
                  fmt::format("give {:.5g} to {:.5g}", limits.slowest.value(), limits.fastest.value()));
  }
  const Seconds longest = period(s.rate);
  if (!(s.phase >= Seconds(0) && s.phase < longest)) {
    return refuse(fmt::format("the phase is {} s", s.phase.value()),
                  fmt::format("give at least 0 and less than {:.6g} s", longest.value()));
  }
  if (!(s.width >= limits.narrowest && s.width <= limits.widest && s.width < longest)) {
    return refuse(fmt::format("the flash width is {} s", s.width.value()),
                  fmt::format("give {:.3g} s to {:.6g} s, and less than a period of {:.6g} s",
                              limits.narrowest.value(), limits.widest.value(), longest.value()));
  }
  if (s.code.size() > limits.longest_code) {
    if (limits.longest_code == 0) {
      return refuse(fmt::format("{} can't skip flashes, and the code has {}", limits.device, s.code.size()),
                    "use Emberlock's own controller for coded flashes");
    }
    return refuse(fmt::format("the code has {} flashes", s.code.size()),
                  fmt::format("give at most {}", limits.longest_code));
  }
  if (s.output == StrobeOutput::steady && limits.steady == Limits::Steady::no)
    return refuse(fmt::format("{} can't give steady light", limits.device), "give off or flashing");
  return {};
}

Error garbled(std::string_view reply, std::string_view expected) {
  constexpr std::size_t kShown = 60;
  std::string shown;
  for (const char c : reply.substr(0, kShown)) {
    if (std::isprint(static_cast<unsigned char>(c)) != 0)
      shown += c;
    else
      shown += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  }
  return Error{ErrorKind::device,
               fmt::format("it answered \"{}\" instead of {}", shown, expected),
               {},
               "check the cable, the baud rate and the dialect"};
}

std::string_view trim(std::string_view text) {
  constexpr std::string_view kBlank = " \t\r\n";
  const auto first = text.find_first_not_of(kBlank);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kBlank) - first + 1);
}

std::vector<std::string_view> split(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  while (true) {
    const auto end = text.find(separator);
    parts.push_back(trim(text.substr(0, end)));
    if (end == std::string_view::npos) return parts;
    text.remove_prefix(end + 1);
  }
}

std::optional<double> number_in(std::string_view text) {
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

std::optional<double> number_in(std::string_view text, std::string_view unit) {
  const auto same = [](char a, char b) {
    return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
  };
  if (text.size() > unit.size() && std::equal(unit.rbegin(), unit.rend(), text.rbegin(), same))
    text.remove_suffix(unit.size());
  return number_in(text);
}

Result<std::string> identity(std::string_view reply) {
  const auto fields = split(reply, ',');
  constexpr std::size_t kFields = 4;  // IEEE 488.2, 10.14; some makers add more
  if (fields.size() < kFields || fields[0].empty() || number_in(fields[0]))
    return garbled(reply, "maker, model, serial number and version");
  return fmt::format("{} {} {}", fields[0], fields[1], fields[2]);
}

void add_width_and_rate(std::vector<Command>& commands, Command width, Command rate, const StrobeSettings& to,
                        const StrobeSettings& now) {
  const bool shorter = to.width <= now.width;
  commands.push_back(shorter ? width : rate);
  commands.push_back(shorter ? std::move(rate) : std::move(width));
}

}  // namespace strobe_serial
}  // namespace emberlock::drivers
