// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/strobe_serial/dialect.h"

// Shared by the dialects; private to drivers/strobe_serial.
namespace emberlock::drivers::strobe_serial {

std::unique_ptr<const Dialect> make_controller(const DialectOptions& options);
std::unique_ptr<const Dialect> make_scpi(const DialectOptions& options);
std::unique_ptr<const Dialect> make_siglent(const DialectOptions& options);
std::unique_ptr<const Dialect> make_gardasoft(const DialectOptions& options);
std::unique_ptr<const Dialect> make_schott(const DialectOptions& options);

/// The limits of a device's settings.
struct Limits {
  std::string_view device;  ///< in messages: "a pulse generator"
  Hertz slowest{0.5}, fastest{20000.0 / 60};
  Seconds narrowest, widest;
  std::size_t longest_code = 0;
  enum class Steady { no, yes } steady = Steady::no;
};

/// Error bad_input: names the setting and its range.
Status check(const StrobeSettings& settings, const Limits& limits);

Error garbled(std::string_view reply, std::string_view expected);

std::string_view trim(std::string_view text);
std::vector<std::string_view> split(std::string_view text, char separator);
/// A finite number that takes up the whole text; a leading + is accepted.
std::optional<double> number_in(std::string_view text);
/// A number that may be followed directly by its unit: "0.02S" with unit "S". Case-insensitive.
std::optional<double> number_in(std::string_view text, std::string_view unit);

/// Maker, model and serial number from the reply to *IDN?.
Result<std::string> identity(std::string_view reply);

/// Orders the commands so that the pulse is shorter than the period after each: `width` comes first if it
/// decreases.
void add_width_and_rate(std::vector<Command>& commands, Command width, Command rate, const StrobeSettings& to,
                        const StrobeSettings& now);

}  // namespace emberlock::drivers::strobe_serial
