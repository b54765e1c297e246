// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/quantity.h"
#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// A light found from the pictures on a coarse grid.
struct FoundLight {
  Light light;
  PerMeter density{0};     ///< mean extinction in the hull: what a solver begins with
  double error = 0;        ///< RMS that a medium so lit leaves of the fitted pixels, grey levels
  double even_error = 0;   ///< the same of even light from all sides
  double other_error = 0;  ///< of the best distant light where a nearby one was found, or the other way round
};

/// Which light from outside explains the pictures best, as though nothing glowed: cold solves for the density
/// (LitDescent) from a fraction of the pixels, each under another light; descent from a wrong direction
/// doesn't recover. First even light, then distant ones from directions spread over the sphere, each with
/// densities of several scales; the best direction is refined, and a nearby light sought along it. A light with
/// a direction must lower the error by kLeastLessError, one nearby again as much. If `asked` names
/// another source than `found`, only the density is sought. Solves are few where a budget is nearly spent.
FoundLight find_light(const SolverSetup& setup, const Light& asked, const Elapsed& elapsed = {});

inline constexpr double kLeastLessError = 0.01;

}  // namespace emberlock::recon
