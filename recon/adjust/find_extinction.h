// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// The extinction found from the pictures on a coarse grid.
struct FoundExtinction {
  Extinction extinction;  ///< initial value of a field, or none
  double error = 0;       ///< RMS over held-out pixels, grey levels
  Volume volume;          ///< the coarse solution: emission, and extinction if there is any
  Hull hull;              ///< its medium
};

/// Finds how much light the medium absorbs, and whether uniformly or like soot. Descent from a wrong scale
/// doesn't recover, so this is a global search: cold solves for emission and extinction together, with a
/// fraction of the pixels, each with another expected extinction, compared on held-out pixels of the input
/// views. `setup.hull` is the hull of the fine grid.
///
/// With a budget, the search ends when it has used a third of it.
FoundExtinction find_extinction(const SolverSetup& setup, const Elapsed& elapsed = {});

/// The same solve for a given extinction.
FoundExtinction try_extinction(const SolverSetup& setup, const Extinction& extinction);

}  // namespace emberlock::recon
