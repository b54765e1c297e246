// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "smear_sync/reading.h"

namespace emberlock::smear {

/// The lamp of a camera that stands still, from the readings of many frames: the mean over the unsaturated
/// ones where there are three or more (a saturated lamp's outline is 0.07..0.7 rows off, the same way in
/// every frame), else over all. `sigma` covers the readings' own errors and their scatter; that of saturated
/// lamps doesn't fall with their number. Readings more than a pixel off the median don't count. Nothing
/// without a lamp.
std::optional<LampReading> combine_lamps(std::span<const SmearReading> film);

/// Reads again what single frames of one camera left ambiguous, by what moves: the dots of a strobe that is
/// detuned or moved walk together; reflections keep their place beside the lamp and hot pixels their row. A
/// frame is settled when exactly one spot for each of its lamps moves, and over the film they travel
/// `least_travel` or more: an even walk of four rows stands nowhere for half of its frames, which is what
/// standing still means here. Frames in order; those that stay ambiguous say why.
std::vector<SmearReading> settle(std::span<const SmearReading> film, Rows least_travel = Rows(4));

/// The film with combine_lamps()' lamp in every frame whose own lies within a pixel of it, the rest as it
/// was: frames that show the lamp unsaturated measure it for those that don't.
std::vector<SmearReading> share_lamp(std::span<const SmearReading> film);

}  // namespace emberlock::smear
