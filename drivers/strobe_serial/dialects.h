// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/strobe_serial/dialect.h"

// What the dialects share; private to drivers/strobe_serial.
namespace emberlock::drivers::strobe_serial {

std::unique_ptr<const Dialect> make_controller(const DialectOptions& options);
std::unique_ptr<const Dialect> make_scpi(const DialectOptions& options);
std::unique_ptr<const Dialect> make_siglent(const DialectOptions& options);
std::unique_ptr<const Dialect> make_gardasoft(const DialectOptions& options);
std::unique_ptr<const Dialect> make_schott(const DialectOptions& options);

/// What a device can do of StrobeSettings.
struct Limits {
  std::string_view device;  ///< as it is spoken of: "a pulse generator"
  Hertz slowest{0.5}, fastest{20000.0 / 60};
  Seconds narrowest, widest;
  std::size_t longest_code = 0;
  enum class Steady { no, yes } steady = Steady::no;
};

/// Error bad_input: names the value and the range.
Status check(const StrobeSettings& settings, const Limits& limits);

Error garbled(std::string_view reply, std::string_view expected);

std::string_view trim(std::string_view text);
std::vector<std::string_view> split(std::string_view text, char separator);
/// A finite number that fills the text; a leading + is fine.
std::optional<double> number_in(std::string_view text);
/// A number with a unit that may follow it at once: "0.02S" with unit "S". Case is ignored.
std::optional<double> number_in(std::string_view text, std::string_view unit);

/// Maker, model and serial number from what *IDN? answers.
Result<std::string> identity(std::string_view reply);

/// Commands in an order in which the pulse is shorter than the period after each: `width` first when that
/// becomes shorter.
void add_width_and_rate(std::vector<Command>& commands, Command width, Command rate, const StrobeSettings& to,
                        const StrobeSettings& now);

}  // namespace emberlock::drivers::strobe_serial
