// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// Whether a medium is lit from outside rather than glowing, and how.
struct LightChoice {
  Light light;            ///< none where it glows
  Extinction extinction;  ///< what a solver begins with under that light; else `otherwise`
  EffectReport report;    ///< its change: by how much left-out views' error falls
};

/// By hand (`request.fixed`) what is asked for, with what the pictures tell of it. Else find_light(), whose
/// light is believed where it has a direction, since what is lit from all sides looks like what glows evenly,
/// and where views that are left out of the fit (left_out_views.h) are shown better by a density under it
/// than by light and extinction that are free, by kLeastGainOfLight. `otherwise` is the extinction that was
/// chosen for those; `absorbs` whether any was found, without which nothing scatters. Throws Diverged where
/// no fit under a light by hand comes to an end.
LightChoice choose_light(const SolverSetup& setup, const Extinction& otherwise, bool absorbs,
                         const EffectRequest& request, const Elapsed& elapsed = {});

/// What glows gains by the tie too: a simulated candle 12 %, if even light were believed.
inline constexpr double kLeastGainOfLight = 0.1;

}  // namespace emberlock::recon
