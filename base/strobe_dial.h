// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock {

/// The dial of a strobe that is set by hand and has no interface to a program. Its scale is in flashes per
/// minute.
struct StrobeDial {
  Hertz slowest{30.0 / 60};
  Hertz fastest{20000.0 / 60};
  Hertz step{0.1 / 60};  ///< between two settings, > 0

  /// The setting closest to a rate.
  [[nodiscard]] Hertz nearest(Hertz rate) const;
  /// The rate as the dial shows it, with as many digits as its step has: "1438.6".
  [[nodiscard]] std::string per_minute(Hertz rate) const;
  friend bool operator==(const StrobeDial&, const StrobeDial&) = default;
};

/// Error bad_input: the step isn't above 0 and at most 100 flashes a minute, or the range is empty.
Status check(const StrobeDial& dial);

}  // namespace emberlock
