// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "smear_sync/detect/column_patch.h"
#include "smear_sync/detect/dot_fit.h"

namespace emberlock::smear::detail {

/// Whether the spot is a reflection: wider across columns than the lamp, or as bright as it. Charge moves
/// along its column, so a dot is as wide as its lamp, however far its light is spread along rows.
///
/// The half-widths of lamp and spot, in pixels, come from the same model (EdgeFit), both with the lamp's
/// blur. The spot is wider if it exceeds the lamp's by more than four standard errors of both. The lamp is
/// measured at the first use and stored in `lamp`.
///
/// An unclipped lamp gives its half-width and its blur. A clipped one shows only its flanks, in which
/// half-width and blur can't be separated: more blur looks like a narrower lamp. So the blur is assumed to be
/// that of a lens in focus, or the sharpest that the spot's own blur allows, since a dot has the lens's blur.
/// With a softer lens the lamp then seems wider than it is, and fewer spots are rejected.
///
/// Light beside the spot, where a copy of the lamp has none, is detected without a fit. Quantisation softens
/// edges: in compressed frames a tenth of the half-width isn't a significant difference, and frames without
/// any noise aren't tested.
bool wider_than_lamp(const Plane& plane, const Column& c, const Lamp& lamp, const FitWindow& window,
                     const DotFit& spot);

}  // namespace emberlock::smear::detail
