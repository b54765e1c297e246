// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>

#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/read_mode.h"

namespace emberlock::smear {

/// What the ends of a clip's lit stretches tell of d, without any walk of the dots.
struct DarkDirection {
  std::optional<ReadDirection> direction;  ///< absent where they tell too little
  std::string reason;                      ///< what was seen; empty where no stretch ended
};

/// A dot that wrapped is of the flash that lit its frame's picture, one that did not is of the flash after
/// (frame_code.h). So the last frame before a dark one has its dot when dots wrap, and lacks it when they
/// don't: with the side of the lamp on which the neighbours' dots stand, that is d, however slow the beat. A
/// half covered lamp may lack its dot either way: how often, the first frames after dark ones tell, whose dot
/// is there under both. Claimed at odds of 1000 to 1. Frames in order; pure.
DarkDirection direction_by_dark_frames(std::span<const FrameReading> frames);

}  // namespace emberlock::smear
