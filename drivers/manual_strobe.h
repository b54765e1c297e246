// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/strobe_dial.h"
#include "drivers/strobe.h"

namespace emberlock::drivers {

/// A strobe with a dial, that somebody sets by hand. It is told nothing and says nothing: apply() notes what
/// somebody is to set, rounded to the dial's steps, and read_back() gives that, not what the dial shows; what
/// it really does is read from the frames (smear_sync/clocks/flash_rate.h). The lamp is left flashing: what
/// is asked for is a rate. Of flash widths it knows nothing, and takes any.
class ManualStrobe : public Strobe {
 public:
  /// `dial` is valid.
  explicit ManualStrobe(std::string id, const StrobeDial& dial = {});

  [[nodiscard]] const std::string& id() const override { return id_; }
  /// Error bad_input: a rate beyond the dial. Error refused: anything but flashing at a rate, which no dial
  /// does: another phase, a code of skipped flashes, steady light, or darkness.
  Status apply(const StrobeSettings& settings) override;
  Result<StrobeSettings> read_back() override { return asked_; }
  [[nodiscard]] std::optional<StrobeDial> dial() const override { return dial_; }

 private:
  std::string id_;
  StrobeDial dial_;
  StrobeSettings asked_;
};

}  // namespace emberlock::drivers
