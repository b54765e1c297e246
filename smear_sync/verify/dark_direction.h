// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/read_mode.h"

namespace emberlock::smear {

/// The read direction d, determined from the ends of a clip's lit intervals, without a walk of the dots.
struct DarkDirection {
  std::optional<ReadDirection> direction;  ///< absent if the evidence is too weak
  std::string reason;                      ///< the observation; empty if no lit interval ended
};

/// A wrapped dot belongs to the flash that lit its frame's picture, other dots to the next flash
/// (frame_code.h). So the last lit frame before a dark one shows its dot if dots wrap, and doesn't if they
/// don't. Together with the side of the lamp on which neighbouring dots lie, this gives d, however slow the
/// beat is. A half covered lamp may lose its dot in either case; how often is estimated from the first frames
/// after dark ones, whose dot is visible in both cases. A direction is accepted at odds of 1000 to 1. Frames
/// must be in order. Pure.
DarkDirection direction_by_dark_frames(std::span<const FrameReading> frames);

}  // namespace emberlock::smear
