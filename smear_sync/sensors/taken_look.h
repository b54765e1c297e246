// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <vector>

#include "smear_sync/sensors/phase_sensor.h"

// Shared by the sensors.
namespace emberlock::smear::detail {

/// A frame: its arrival, the strobe's setting, and its reading.
struct TakenLook {
  TimePoint at;
  Look look;
  SmearReading reading;
};

/// The phases of the frames whose flashes had this delay.
std::vector<PhaseSample> phases_at(Seconds delay, std::span<const TakenLook> taken,
                                   const SensorOptions& options);

/// Why no edge of this exposure can be seen: it is hardly longer than the flash. Empty if it is long enough.
std::string too_short(Seconds exposure, Seconds flash_width);

}  // namespace emberlock::smear::detail
