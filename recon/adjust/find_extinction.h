// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/adjust/tracker.h"
#include "recon/views/flame_mask.h"

namespace emberlock::recon {

/// A hull of about 4000 voxels over the medium's own bounds, whatever grid a run asks for, so that a choice
/// made on it doesn't depend on that grid. It is coarser where the pictures of `setup.views` don't resolve
/// that many. `refinement` multiplies the number of voxels along each side. Errors: those of carve().
Result<Hull> carve_probe(const SolverSetup& setup, const Scene& linear, const std::vector<FlameMask>& masks,
                         double refinement = 1);

/// The extinction estimated from the pictures.
struct EstimatedExtinction {
  Extinction extinction;  ///< initial value of a field, or none
  /// Validation errors with it and with none, grey levels; 0 where there was no time.
  double error = 0;
  double error_of_none = 0;
  /// The thinnest and the thickest candidate whose validation errors exceed its by less than a twentieth.
  std::vector<Extinction> alternatives = {};
};

/// Estimates how much light the medium absorbs, and whether uniformly, like soot, or half of each. Descent
/// from a wrong scale doesn't recover, so this is a global search by cross-validation (Stone 1974): solves on
/// the hull of `probing` (of carve_probe()), each by as many steps from zero, judged on pixels and on views
/// that are left out of the fit. The candidates are no extinction, unless `forced`, and for each distribution
/// optical depths that double along the mean ray; uniform and soot-like ones only if a mixture of both lowers
/// the error.
///
/// With a budget, the search ends when it has used a third of it.
EstimatedExtinction find_extinction(const SolverSetup& probing, bool forced, const Elapsed& elapsed = {});

/// The validation errors of an extinction and of none on a finer hull and four times as many pixels.
EstimatedExtinction score_closer(const SolverSetup& closer, const Extinction& extinction);

/// A rough solution with a given extinction.
struct CoarseSolution {
  Volume volume;  ///< emission, and extinction if there is any
  Hull hull;      ///< its medium
};
/// A cold solve on the hull of `setup`, coarsened to at most 64 voxels along its longest side.
CoarseSolution try_extinction(const SolverSetup& setup, const Extinction& extinction);

}  // namespace emberlock::recon
