// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/adjust/coarse_pictures.h"
#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"

namespace emberlock::recon {

/// Decides on every effect except the extinction, which is given in `found` (Volume::extinction if it is a
/// field). An effect is on if it changes the coarse pictures by at least the request's tolerance; each is
/// tested alone, on top of the extinction. The effects' parameters come from the pictures where possible
/// (background pictures or the level at the borders, clipped pixels), otherwise from `request.assumed`. With
/// `request.fixed` the listed effects are on and only predicted; others aren't tested.
///
/// The choice contains `found`'s extinction and the effects that are on; its reports are "scattering", "phase
/// function", "refraction", "background", "exposure", "gamma" and "saturation". The same for any number of
/// threads; without `elapsed` times and costs are 0. Error: a background picture with another size than its
/// image.
Result<EffectChoice> predict_effects(const CoarseFlame& flame, const Effects& found,
                                     const EffectRequest& request, const ComputeOptions& compute,
                                     const Elapsed& elapsed = {});

}  // namespace emberlock::recon
