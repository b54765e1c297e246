// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/adjust/coarse_pictures.h"
#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"

namespace emberlock::recon {

/// Decides on every effect but the extinction, which `found` brings (Volume::extinction where it is a field).
/// An effect is on if it changes the coarse pictures by at least the request's tolerance: each is probed
/// alone, on top of the extinction. What each is like comes from the pictures where they tell it (background
/// pictures or the level at the borders, clipped pixels) and from `request.assumed` where they can't. With
/// `request.fixed` those are on and only predicted, and what it leaves out isn't probed.
///
/// The choice holds `found`'s extinction and what is on; its reports are "scattering", "phase function",
/// "refraction", "background", "exposure", "gamma" and "saturation". The same choice for any number of
/// threads; without `elapsed` times and costs are 0. Error: a background picture that isn't of its image's
/// size.
Result<EffectChoice> predict_effects(const CoarseFlame& flame, const Effects& found,
                                     const EffectRequest& request, const ComputeOptions& compute,
                                     const Elapsed& elapsed = {});

}  // namespace emberlock::recon
