// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/quantity.h"
#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// A light found from the pictures on a coarse grid.
struct FoundLight {
  Light light;
  PerMeter density{0};  ///< mean extinction in the hull: what a solver begins with
  double error = 0;     ///< RMS that a medium so lit leaves of the fitted pixels, grey levels; infinite
                        ///< where every fit diverged
  std::optional<double> even_error;  ///< the same of even light from all sides, where it was tried
};

/// Which light from outside explains the pictures best, as though nothing glowed: cold solves for the density
/// (LitDescent) from a fraction of the pixels, each under another light; descent from a wrong direction
/// doesn't recover. First even light, then distant ones from directions spread over the sphere, the best with
/// densities of several scales; some 20 degrees is what so coarse a grid tells. A light with a direction must
/// lower the error by kLeastLessError. If `asked` names another source than `found`, only the density is
/// sought. A budget ends the search with what it has.
FoundLight find_light(const SolverSetup& setup, const Light& asked, const Elapsed& elapsed = {});

/// A distant light's direction on a grid twice as fine, which takes ten times as long; or a light nearby in
/// that direction, where it lowers the error by kLeastLessError again. Other lights are returned as they are,
/// and so is one that no fit on the finer grid comes to an end with. A budget ends it with what it has.
FoundLight refine_light(const SolverSetup& setup, const FoundLight& rough, const Elapsed& elapsed = {});

inline constexpr double kLeastLessError = 0.01;

}  // namespace emberlock::recon
