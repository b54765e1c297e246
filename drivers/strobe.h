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

/// Settings of a strobe, as requested and as read back.
struct StrobeSettings {
  StrobeOutput output = StrobeOutput::off;
  Hertz rate{23.976};  ///< flashes per second, 0.5 .. 333.3 (30 .. 20000 per minute)
  Seconds phase{};     ///< delay of every flash relative to the strobe's time base, 0 <= phase < 1 / rate
  Seconds width = microseconds(20);  ///< flash duration, > 0 and < 1 / rate
  std::vector<bool> code{};          ///< repeated endlessly: false skips a flash; empty: no flash is skipped
  friend bool operator==(const StrobeSettings&, const StrobeSettings&) = default;
};

/// An opened strobe. One owner thread; not thread-safe.
class Strobe {
 public:
  virtual ~Strobe() = default;
  [[nodiscard]] virtual const std::string& id() const = 0;
  /// Takes effect before it returns. Errors: bad_input (out of range; names the setting and its range),
  /// device (gone, or the reported setting differs by more than the strobe's step), timed_out (silent).
  virtual Status apply(const StrobeSettings& settings) = 0;
  /// The settings that the strobe itself reports, rounded to its steps.
  virtual Result<StrobeSettings> read_back() = 0;
  /// The dial of a strobe that is set by hand. apply() then only requests a setting; the actual one is
  /// measured from frames.
  [[nodiscard]] virtual std::optional<StrobeDial> dial() const { return std::nullopt; }
};

}  // namespace emberlock::drivers
