// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"

namespace emberlock::cli {

/// Where a camera's shutter stands.
struct CirclePoint {
  std::string name;
  std::optional<Seconds> error;  ///< to the target; positive when it reads earlier; none: not seen
};

/// Shutters on the circle that a frame's period is, for a terminal: the target on top, later ones to the
/// right, the tolerance drawn as ':', cameras as letters with their offsets beside it. At most 100 columns.
/// The target of staggered cameras is each one's own instant.
std::string phase_circle(const std::vector<CirclePoint>& cameras, Seconds period, Seconds tolerance,
                         SecondsPerRow row_time, bool staggered = false);

}  // namespace emberlock::cli
