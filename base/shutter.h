// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "base/quantity.h"

namespace emberlock {

/// How a camera's shutter phase can be drawn anew.
enum class ShutterReset : std::uint8_t {
  none,
  by_hand,     ///< an operator presses a button; the phase that follows is uniform over the frame period
  on_command,  ///< its driver does it, a latency with some jitter after the moment asked for
};

/// How a camera's frame rate can be trimmed while it films.
struct FrameRateTrim {
  PartsPerMillion range;  ///< to either side of its own rate, > 0
  PartsPerMillion step;   ///< between two settings, > 0
  Seconds latency;        ///< from the order to the first frame at the new rate, on average, >= 0
};

}  // namespace emberlock
