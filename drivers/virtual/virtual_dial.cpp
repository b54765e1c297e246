// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/virtual_dial.h"

#include <algorithm>
#include <utility>

namespace emberlock::drivers {

VirtualDial::VirtualDial(const VirtualStrobeOptions& options, std::shared_ptr<Clock> clock,
                         std::shared_ptr<StrobeTimeline> timeline)
    : ManualStrobe(options.id, options.dial->dial),
      error_(options.dial->error),
      width_(options.dial->width),
      clock_(std::move(clock)),
      timeline_(std::move(timeline)) {}

Hertz VirtualDial::truth() const { return shown_ * (1 + error_.value() * 1e-6); }

void VirtualDial::turn(Hertz shown) {
  shown = std::clamp(shown, dial()->slowest, dial()->fastest);
  if (shown == shown_) return;
  shown_ = shown;
  timeline_->apply({.output = StrobeOutput::flashing, .rate = truth(), .width = width_}, clock_->now());
}

}  // namespace emberlock::drivers
