// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "smear_sync/sensors/phase_sensor.h"

// What the sensors share.
namespace emberlock::smear::detail {

/// A frame: when it came, how it was lit, and what it shows.
struct TakenLook {
  TimePoint at;
  Look look;
  SmearReading reading;
};

/// The phases of those whose flashes came `delay` late.
std::vector<PhaseSample> phases_at(Seconds delay, std::span<const TakenLook> taken,
                                   const SensorOptions& options);

/// Why no flash tells an edge of this exposure: it is hardly longer than the flash. Empty when it is longer.
std::string too_short(Seconds exposure, Seconds flash_width);

}  // namespace emberlock::smear::detail
