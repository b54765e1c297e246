// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/quantity.h"

namespace emberlock {

/// How a camera's shutter can be given a new phase.
enum class ShutterReset : std::uint8_t {
  none,
  by_hand,     ///< an operator presses a button; the new phase is uniform over the frame period
  on_command,  ///< the driver resets it, with a latency and jitter after the requested time
};

/// The range in which a camera's frame rate can be trimmed while it films.
struct FrameRateTrim {
  PartsPerMillion range;  ///< on either side of the camera's own rate, > 0
  PartsPerMillion step;   ///< between two settings, > 0
  Seconds latency;        ///< mean time from the command to the first frame at the new rate, >= 0
};

}  // namespace emberlock
