// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock {

/// The knob of a strobe that somebody sets by hand, and that no program can talk to. People read it in
/// flashes per minute.
struct StrobeDial {
  Hertz slowest{30.0 / 60};
  Hertz fastest{20000.0 / 60};
  Hertz step{0.1 / 60};  ///< between two settings, > 0

  /// The setting nearest to a rate.
  [[nodiscard]] Hertz nearest(Hertz rate) const;
  /// "1438.6", as far as the dial's steps tell.
  [[nodiscard]] std::string per_minute(Hertz rate) const;
  friend bool operator==(const StrobeDial&, const StrobeDial&) = default;
};

/// Error bad_input: the step isn't above 0 and at most 100 flashes a minute, or the range is empty.
Status check(const StrobeDial& dial);

}  // namespace emberlock
