// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::drivers {

/// A luminous object that virtual cameras film: the interface for adding a flame to their pictures.
/// Implementations must be callable from the threads of several cameras at once, and give the same light for
/// the same arguments.
class LightField {
 public:
  virtual ~LightField() = default;

  /// ADDS the light that camera number `camera` of the rig collects during [exposure_start, exposure_start +
  /// exposure) on the rig's clock. `rgb` holds 3 * width * height linear grey levels on the scale 0..255
  /// (higher values saturate), R, G, B interleaved, row by row from the top.
  virtual void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                            std::span<float> rgb) const = 0;
};

}  // namespace emberlock::drivers
