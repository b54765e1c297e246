// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/strobe_dial.h"

namespace emberlock::drivers {

enum class StrobeOutput { off, flashing, steady };

/// What a strobe is asked to do, and what it reads back.
struct StrobeSettings {
  StrobeOutput output = StrobeOutput::off;
  Hertz rate{23.976};  ///< flashes a second, 0.5 .. 333.3 (30 .. 20000 a minute)
  Seconds phase{};     ///< delay of every flash against the strobe's own time base, 0 <= phase < 1 / rate
  Seconds width = microseconds(20);  ///< flash duration, > 0 and < 1 / rate
  std::vector<bool> code{};          ///< repeated without end: false skips that flash; empty flashes always
  friend bool operator==(const StrobeSettings&, const StrobeSettings&) = default;
};

/// A strobe, opened. One owner thread; not thread-safe.
class Strobe {
 public:
  virtual ~Strobe() = default;
  [[nodiscard]] virtual const std::string& id() const = 0;
  /// Takes effect before it returns. Errors: bad_input (out of range: says which and the range), device
  /// (gone, or what it says that it does is more than its own steps away), timed_out (silent).
  virtual Status apply(const StrobeSettings& settings) = 0;
  /// What the strobe itself says that it does, rounded to its own steps.
  virtual Result<StrobeSettings> read_back() = 0;
  /// Of one that somebody sets by hand: what can be set. apply() then asks for it, and what was set is read
  /// from frames.
  [[nodiscard]] virtual std::optional<StrobeDial> dial() const { return std::nullopt; }
};

}  // namespace emberlock::drivers
