// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/prepared_scene.h"
#include "recon/adjust/solver.h"
#include "recon/effects/effects.h"

namespace emberlock::recon {

/// A scene under what must be known before the flame can be looked at: what is set by hand, else response,
/// clipped pixels and background, as far as the pictures tell them.
PreparedScene under_known_effects(const PreparedScene& filmed, const EffectRequest& request,
                                  const ComputeOptions& compute = {});

/// Decides which effects the pictures of a scene that is under_known_effects() call for. With `request.fixed`
/// it takes those and only predicts their change, but for the scale of an extinction field, which it
/// estimates. Otherwise the extinction is estimated by cross-validation on a grid of its own
/// (find_extinction.h), so that it doesn't depend on `grid`; it stays off unless it lowers the validation
/// error by a twentieth, on that grid and on one twice as fine. An effect whose predicted change lies below
/// the tolerance is off. Errors: a gamma for pictures that are linearised; a device that can't run; no hull.
Result<EffectChoice> choose_effects(const PreparedScene& scene, const Grid& grid,
                                    const EffectRequest& request, const SolveOptions& options,
                                    const Elapsed& elapsed = {});
/// The same from a scene as it was filmed. Errors: check_scene()'s too.
Result<EffectChoice> choose_effects(const Scene& scene, const Grid& grid, const EffectRequest& request,
                                    const SolveOptions& options, const Elapsed& elapsed = {});

}  // namespace emberlock::recon
