// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/strobe.h"

// The protocols of serial strobes, independent of a port: settings are converted to commands, replies to
// settings or errors. The caller, who knows the device, fills in an error's `where`.
namespace emberlock::drivers {

enum class StrobeDialect {
  emberlock,     ///< our own controller, PROTOCOL.md
  scpi,          ///< pulse generators with IEEE 488.2 and SCPI: Keysight, Rigol, newer ones of Siglent
  siglent_bswv,  ///< Siglent's SDG: C1:BSWV
  gardasoft_rt,  ///< Gardasoft's RT and VTR lighting controllers
  schott_cv_ls,  ///< Schott's ColdVision light source
};

/// "scpi", as in the command line and the configuration.
std::string_view name_of(StrobeDialect dialect);
/// Error bad_input: unknown dialect; lists all dialects.
Result<StrobeDialect> parse_strobe_dialect(std::string_view name);

/// The meaning of SCPI's PHASe in a generator.
enum class ScpiPhase {
  start,  ///< the angle at which a period starts, in degrees: a later flash has a smaller angle
  delay,  ///< the angle by which the pulse is delayed, read back in radians (Agilent 81100)
};

struct DialectOptions {
  int channel = 1;                     ///< generators: 1..2, Gardasoft: 1..8, Schott: 1..4, our controller: 1
  double brightness = 100;             ///< per cent, > 0, <= 100; Gardasoft only
  ScpiPhase phase = ScpiPhase::start;  ///< SCPI only
  Seconds watchdog{};  ///< our controller switches off when it gets no command for this long; 0 (never) or
                       ///< 0.1..600 s
};

enum class Answer {
  none,     ///< the device sends no reply
  status,   ///< the reply says whether the command was accepted
  value,    ///< the reply is the requested value
  ignored,  ///< the reply is ignored
};

struct Command {
  std::string text;  ///< without framing
  Answer answer = Answer::none;
  friend bool operator==(const Command&, const Command&) = default;
};

struct Framing {
  int baud = 9600;
  char end = '\n';            ///< end of a reply
  std::size_t longest = 256;  ///< length of a reply in bytes
  bool numbered =
      false;  ///< replies carry the number of their command, so a command may be repeated at any time
};

/// How far the reported settings may differ from the requested ones: the device's steps. A larger difference
/// is an error.
struct Rounding {
  Hertz rate;
  Seconds phase, width;
};

/// One protocol. Immutable and thread-safe; the same input gives the same output.
class Dialect {
 public:
  virtual ~Dialect() = default;
  [[nodiscard]] virtual Framing framing() const = 0;
  /// The bytes that carry a command. `number` counts commands; most devices don't receive it.
  [[nodiscard]] virtual std::string frame(std::string_view text, std::uint8_t number) const = 0;
  /// The content of a reply line (without its end) to command `number`; nullopt if the line should be
  /// skipped. Error device: garbled.
  [[nodiscard]] virtual Result<std::optional<std::string>> unframe(std::string_view line,
                                                                   std::uint8_t number) const;

  /// A query that is harmless, also for devices with another dialect.
  [[nodiscard]] virtual Command hello() const = 0;
  /// Maker, model and serial number from the reply to hello(). Error device: a device of another kind.
  [[nodiscard]] virtual Result<std::string> model(std::string_view reply) const = 0;

  /// The commands that change the device from `now` (if known) to `to`. Error bad_input: not possible; names
  /// the setting and its range.
  [[nodiscard]] virtual Result<std::vector<Command>> apply(
      const StrobeSettings& to, const std::optional<StrobeSettings>& now) const = 0;
  /// Whether the device accepted the command. Errors: bad_input (out of its range), device.
  [[nodiscard]] virtual Status accepted(const Command& command, std::string_view reply) const = 0;

  /// For valid settings (apply()) with flashing output.
  [[nodiscard]] virtual Rounding rounding(const StrobeSettings& to) const = 0;

  /// The query after these replies; nullopt when they contain everything.
  [[nodiscard]] virtual std::optional<Command> question(std::span<const std::string> answers) const = 0;
  /// The settings in all replies. Error device: garbled, or not possible for a strobe.
  [[nodiscard]] virtual Result<StrobeSettings> settings(std::span<const std::string> answers) const = 0;
};

/// Error bad_input: an option is out of range.
Result<std::unique_ptr<const Dialect>> make_dialect(StrobeDialect dialect,
                                                    const DialectOptions& options = {});

}  // namespace emberlock::drivers
