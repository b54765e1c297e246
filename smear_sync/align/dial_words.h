// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/strobe_dial.h"
#include "smear_sync/clocks/flash_rate.h"

// What is said to whoever sets a strobe by its dial.
namespace emberlock::smear {

/// "1438.6 flashes a minute (23.977 Hz)"
std::string setting(Hertz rate, const StrobeDial& dial);
/// "turn it down by 71.9 (4.76 %), to 1438.6 flashes a minute (23.977 Hz)"
std::string turning(Hertz from, Hertz to, const StrobeDial& dial);
/// Names the other rates that would show the same; empty where there are none.
std::string or_else(const std::vector<Hertz>& others, const StrobeDial& dial);
/// Of flashes that are too far off to be followed, or not seen at all.
std::string what_to_do(const FlashRate& flashes, Hertz set, const StrobeDial& dial);

}  // namespace emberlock::smear
