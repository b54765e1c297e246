// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/clock.h"
#include "drivers/manual_strobe.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/strobe_timeline.h"

namespace emberlock::drivers {

/// A strobe without an interface, with a dial that tests turn. Dark until it is first turned.
class VirtualDial final : public ManualStrobe {
 public:
  VirtualDial(const VirtualStrobeOptions& options, std::shared_ptr<Clock> clock,
              std::shared_ptr<StrobeTimeline> timeline);

  /// Turns the dial to `shown`, or to its stop. From now on it flashes at that rate plus the dial's error.
  void turn(Hertz shown);
  /// The reading of the dial; 0 before it is first turned.
  [[nodiscard]] Hertz shown() const { return shown_; }
  /// The true flash rate.
  [[nodiscard]] Hertz truth() const;

 private:
  PartsPerMillion error_;
  Seconds width_;
  std::shared_ptr<Clock> clock_;
  std::shared_ptr<StrobeTimeline> timeline_;
  Hertz shown_{};
};

}  // namespace emberlock::drivers
