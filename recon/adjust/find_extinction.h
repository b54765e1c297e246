// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// What the pictures say of the extinction, from a coarse grid.
struct FoundExtinction {
  Extinction extinction;  ///< a field's first guess, or none
  double error = 0;       ///< RMS over held-out pixels, grey levels
  Volume volume;          ///< the coarse solution: emission, and extinction where there is any
  Hull hull;              ///< its medium
};

/// Finds out how much light the medium takes, and whether evenly or like soot. Descent from a wrong scale
/// stays wrong, so this is a global search: cold solves for emission and extinction together from a fraction
/// of the pixels, each expecting another extinction, judged on held-out pixels of the input views.
/// `setup.hull` is the hull of the fine grid.
///
/// Under a budget the search ends once it has taken a third of it.
FoundExtinction find_extinction(const SolverSetup& setup, const Elapsed& elapsed = {});

/// The same solve for an extinction that is given.
FoundExtinction try_extinction(const SolverSetup& setup, const Extinction& extinction);

}  // namespace emberlock::recon
