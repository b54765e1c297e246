// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"

namespace emberlock::recon {

/// The background and the clipped pixels: before the flame can be looked at, these must be known.
Effects told_by_the_pictures(const Scene& scene, const EffectRequest& request);

/// Decides which effects the pictures call for. With `request.fixed` it takes those and only predicts their
/// change. Otherwise the extinction is found by a global search: cold solves on a coarse grid from a fraction
/// of the pixels, judged on held-out pixels of the input views, then refined by a parabola; an effect whose
/// predicted change lies below the tolerance is off. Errors: check_scene()'s; a gamma for pictures that are
/// linearised.
Result<EffectChoice> choose_effects(const Scene& scene, const Grid& grid, const EffectRequest& request,
                                    const SolveOptions& options, const Elapsed& elapsed = {});

}  // namespace emberlock::recon
