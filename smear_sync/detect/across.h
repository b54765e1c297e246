// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "smear_sync/detect/column_patch.h"
#include "smear_sync/detect/dot_fit.h"

namespace emberlock::smear::detail {

/// Whether the spot is wider across columns than the lamp, or as bright as it: then it is a reflection.
/// Charge moves along its column, so a dot is as wide as its lamp, however its light is drawn out along rows.
///
/// The half widths of lamp and spot, in pixels, are those of one model (EdgeFit), both with the lamp's blur;
/// what exceeds the lamp's by more than four standard errors of both is wider. The lamp's is measured when
/// first asked for, and kept in `lamp`.
///
/// An unclipped lamp tells its half width and its blur. Of a clipped one only the flanks are left, in which
/// half width and blur stand for each other: a little more blur looks like a narrower lamp. The blur is taken
/// for that of a lens in focus, or for the sharpest that the spot's own allows: a dot's is the lens's.
/// A softer lens makes the lamp seem wider than it is, and fewer spots are refused.
///
/// Light beside the spot, where a lamp's copy has none, needs no fit. A quantiser softens edges: in
/// compressed frames a tenth of the half width is no difference, and where no noise survives nothing is
/// asked.
bool wider_than_lamp(const Plane& plane, const Column& c, const Lamp& lamp, const FitWindow& window,
                     const DotFit& spot);

}  // namespace emberlock::smear::detail
