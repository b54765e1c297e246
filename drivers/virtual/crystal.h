// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::drivers {

/// A camera's crystal, whose rate wanders as its temperature goes: a sum of sinusoids an octave apart, from
/// ten minutes to about two days, whose powers rise with the period as those of a random walk do. A closed
/// form, so that any instant can be asked for. Immutable.
class Crystal {
 public:
  /// `wander` is the RMS change of the rate within an hour; 0: it keeps its rate.
  Crystal(PartsPerMillion wander, std::uint64_t seed);

  /// By how much its rate exceeds what it was made for.
  [[nodiscard]] PartsPerMillion rate(TimePoint at) const;
  /// The integral of that: by how much its own time went ahead from instant 0 on.
  [[nodiscard]] Seconds ahead(TimePoint at) const;
  [[nodiscard]] bool steady() const { return waves_.empty(); }

 private:
  struct Wave {
    double rate;     ///< amplitude, parts of one
    double angular;  ///< radians a second
    double phase;
  };
  std::vector<Wave> waves_;
};

}  // namespace emberlock::drivers
