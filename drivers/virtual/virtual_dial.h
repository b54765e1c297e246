// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "base/clock.h"
#include "drivers/manual_strobe.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/strobe_timeline.h"

namespace emberlock::drivers {

/// A stroboscope that listens to nobody, with a dial for tests to turn: dark until it is first turned.
class VirtualDial final : public ManualStrobe {
 public:
  VirtualDial(const VirtualStrobeOptions& options, std::shared_ptr<Clock> clock,
              std::shared_ptr<StrobeTimeline> timeline);

  /// Somebody turns the dial until it shows `shown`, or to its stop: from now on it flashes so often, but for
  /// the dial's error.
  void turn(Hertz shown);
  /// What it shows; 0 before it was turned.
  [[nodiscard]] Hertz shown() const { return shown_; }
  /// What it truly does.
  [[nodiscard]] Hertz truth() const;

 private:
  PartsPerMillion error_;
  Seconds width_;
  std::shared_ptr<Clock> clock_;
  std::shared_ptr<StrobeTimeline> timeline_;
  Hertz shown_{};
};

}  // namespace emberlock::drivers
