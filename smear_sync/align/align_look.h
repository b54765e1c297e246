// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "smear_sync/align/align_context.h"

// What was seen of the cameras, and where to look next.
namespace emberlock::smear {

/// Takes over what the round showed: delays and shifts of resets, trims ordered, phases of the cameras seen.
/// Returns the cameras that somebody has reset without an order.
std::vector<std::size_t> remember(AlignState& state, const AlignContext& c);

/// Where a camera stands at the round's instant: seen now, or earlier and sure enough still.
std::optional<Drift> where(const CameraTrack& track, const AlignContext& c);

/// The strobe's delay for another look: no two in a row are alike.
Seconds next_look(const AlignContext& c);

/// Some phases are missing: nobody is reset on half a view. Blind cameras, and those whose dots are in doubt,
/// are brought out by moving the strobe.
void look_again(AlignState& state, AlignDecision& decision, const AlignContext& c);

/// Cameras whose dots haven't been seen to move with the strobe aren't called aligned: a decision that resets
/// nobody moves the strobe for them. `looks`: rounds in a row that did so or looked for a phase.
void ask_for_moves(AlignState& state, AlignDecision& decision, const AlignContext& c, int looks);

}  // namespace emberlock::smear
