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

// What is said to a strobe on a serial line and what its answers mean, without a port: settings to commands,
// replies to settings or errors. Errors leave `where` to whoever knows the device.
namespace emberlock::drivers {

enum class StrobeDialect {
  emberlock,     ///< our own controller, PROTOCOL.md
  scpi,          ///< pulse generators by IEEE 488.2 and SCPI: Keysight, Rigol, Siglent's newer
  siglent_bswv,  ///< Siglent's SDG: C1:BSWV
  gardasoft_rt,  ///< Gardasoft's RT and VTR lighting controllers
  schott_cv_ls,  ///< Schott's ColdVision light source
};

/// "scpi", as the command line and the configuration name it.
std::string_view name_of(StrobeDialect dialect);
/// Error bad_input: no such dialect; lists them.
Result<StrobeDialect> parse_strobe_dialect(std::string_view name);

/// What SCPI's PHASe means to a generator.
enum class ScpiPhase {
  start,  ///< the angle at which a period starts, in degrees: a later flash starts at a smaller angle
  delay,  ///< an angle by which the pulse comes later, read back in radians (Agilent 81100)
};

struct DialectOptions {
  int channel = 1;                     ///< 1..2 of generators, 1..8 Gardasoft, 1..4 Schott, 1 of ours
  double brightness = 100;             ///< per cent, > 0, <= 100: Gardasoft alone sets it
  ScpiPhase phase = ScpiPhase::start;  ///< SCPI alone
  Seconds watchdog{};  ///< our controller goes dark when told nothing for so long; 0 (never) or 0.1..600 s
};

enum class Answer {
  none,     ///< the device says nothing
  status,   ///< it says whether it obeys
  value,    ///< it says what it is asked for
  ignored,  ///< it says something of no interest
};

struct Command {
  std::string text;  ///< without what frames it
  Answer answer = Answer::none;
  friend bool operator==(const Command&, const Command&) = default;
};

struct Framing {
  int baud = 9600;
  char end = '\n';            ///< of a reply
  std::size_t longest = 256;  ///< reply, in bytes
  bool numbered = false;  ///< replies tell which command they answer, so one may be said again at any time
};

/// How far what a device says that it does may be from what it was asked for: its steps. What it adjusts
/// further isn't what was asked for.
struct Rounding {
  Hertz rate;
  Seconds phase, width;
};

/// One language. Immutable and thread-safe; the same input gives the same output.
class Dialect {
 public:
  virtual ~Dialect() = default;
  [[nodiscard]] virtual Framing framing() const = 0;
  /// The bytes that carry a command. `number` counts commands; most devices don't see it.
  [[nodiscard]] virtual std::string frame(std::string_view text, std::uint8_t number) const = 0;
  /// What a line says (without its end), if it answers command `number`; none when it should be passed over.
  /// Error device: garbled.
  [[nodiscard]] virtual Result<std::optional<std::string>> unframe(std::string_view line,
                                                                   std::uint8_t number) const;

  /// A question that does no harm, to another dialect's device either.
  [[nodiscard]] virtual Command hello() const = 0;
  /// Maker, model and serial number as the answer to hello() tells them. Error device: somebody else's.
  [[nodiscard]] virtual Result<std::string> model(std::string_view reply) const = 0;

  /// What brings the device from `now`, where that is known, to `to`. Error bad_input: it can't; names the
  /// value and the range.
  [[nodiscard]] virtual Result<std::vector<Command>> apply(
      const StrobeSettings& to, const std::optional<StrobeSettings>& now) const = 0;
  /// Whether the device obeyed. Errors: bad_input (out of its range), device.
  [[nodiscard]] virtual Status accepted(const Command& command, std::string_view reply) const = 0;

  /// Of settings that apply() finds possible, while flashing.
  [[nodiscard]] virtual Rounding rounding(const StrobeSettings& to) const = 0;

  /// The question that follows these answers; none when they say all.
  [[nodiscard]] virtual std::optional<Command> question(std::span<const std::string> answers) const = 0;
  /// What all answers say that the device does. Error device: garbled, or it does what no strobe does.
  [[nodiscard]] virtual Result<StrobeSettings> settings(std::span<const std::string> answers) const = 0;
};

/// Error bad_input: an option is out of range.
Result<std::unique_ptr<const Dialect>> make_dialect(StrobeDialect dialect,
                                                    const DialectOptions& options = {});

}  // namespace emberlock::drivers
