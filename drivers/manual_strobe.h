// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/strobe_dial.h"
#include "drivers/strobe.h"

namespace emberlock::drivers {

/// A strobe with a dial that is set by hand. There is no connection to it. apply() stores the requested
/// setting, rounded to the dial's steps, for a person to set; read_back() returns that request, not the
/// dial's position. The true rate is measured from the frames (smear_sync/clocks/flash_rate.h). The lamp is
/// expected to flash always. The flash width is unknown; any is accepted.
class ManualStrobe : public Strobe {
 public:
  /// `dial` must be valid.
  explicit ManualStrobe(std::string id, const StrobeDial& dial = {});

  [[nodiscard]] const std::string& id() const override { return id_; }
  /// Error bad_input: a rate outside the dial's range. Error refused: a setting that a dial doesn't have:
  /// another phase, a code of skipped flashes, steady light, or darkness.
  Status apply(const StrobeSettings& settings) override;
  Result<StrobeSettings> read_back() override { return asked_; }
  [[nodiscard]] std::optional<StrobeDial> dial() const override { return dial_; }

 private:
  std::string id_;
  StrobeDial dial_;
  StrobeSettings asked_;
};

}  // namespace emberlock::drivers
