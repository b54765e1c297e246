// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::drivers {

/// A camera's crystal. Its rate drifts with temperature: a sum of sinusoids an octave apart, with periods
/// from ten minutes to about two days and powers that rise with the period like those of a random walk. It is
/// a closed form, so it can be evaluated at any instant. Immutable.
class Crystal {
 public:
  /// `wander` is the RMS change of the rate within an hour; 0: a constant rate.
  Crystal(PartsPerMillion wander, std::uint64_t seed);

  /// Deviation of the rate from its nominal value.
  [[nodiscard]] PartsPerMillion rate(TimePoint at) const;
  /// The integral of rate(): how far the crystal's time is ahead since instant 0.
  [[nodiscard]] Seconds ahead(TimePoint at) const;
  [[nodiscard]] bool steady() const { return waves_.empty(); }

 private:
  struct Wave {
    double rate;     ///< amplitude, relative (not ppm)
    double angular;  ///< radians per second
    double phase;
  };
  std::vector<Wave> waves_;
};

}  // namespace emberlock::drivers
