// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "smear_sync/reading.h"

namespace emberlock::smear {

/// The lamp of a stationary camera, from the readings of many frames: the mean over the unsaturated ones if
/// there are three or more (a saturated lamp's outline is 0.07..0.7 rows off, by the same amount in every
/// frame), else over all. `sigma` covers the readings' own errors and their scatter; for saturated lamps it
/// doesn't decrease with their number. Readings more than a pixel from the median are ignored. nullopt
/// without a lamp.
std::optional<LampReading> combine_lamps(std::span<const SmearReading> film);

/// Resolves ambiguous readings of one camera by motion. The dots of a detuned or shifted strobe move
/// together; reflections stay at the same place relative to the lamp, and hot pixels in their row. A frame is
/// resolved when exactly one spot for each of its lamps moves, and the spots move by at least `least_travel`
/// over the film. (A spot counts as standing if it is at one place for half of its frames; an even walk of
/// four rows never is.) Frames must be in order; those that stay ambiguous have the reason.
std::vector<SmearReading> settle(std::span<const SmearReading> film, Rows least_travel = Rows(4));

/// The film with combine_lamps()' lamp in every frame whose own lamp is within a pixel of it; other frames
/// are unchanged. So frames with an unsaturated lamp provide its place for the others.
std::vector<SmearReading> share_lamp(std::span<const SmearReading> film);

}  // namespace emberlock::smear
