// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/pipeline/single_run.h"

namespace emberlock::recon {

/// What run_once() would take, measured rather than believed: the effects are searched for as it would, and
/// it is run under them on a grid half as fine, to its own end. That costs about a fifth of the run, and the
/// search.
struct PlannedTime {
  EffectChoice effects;
  Seconds searching{0};  ///< for the effects
  Seconds solving{0};    ///< from then on; the coarse run's, scaled by reference_solves()
  [[nodiscard]] Seconds total() const { return searching + solving; }
};

/// `options`: with voxels, without a budget or target, by the default solver. Errors: those of run_once().
Result<PlannedTime> plan_time(const Task& task, const ReconstructOptions& options, const Progress& progress);

}  // namespace emberlock::recon
