// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/pipeline/single_run.h"

namespace emberlock::recon {

/// Whether a budget or a target is to choose settings.
bool has_goal(const ReconstructOptions& options);

/// Chooses what is left open, runs, and says in Report::plan what was promised and what came of it:
/// - a reference run (reference_run.h) scales the reference front to this machine and scene;
/// - choose() takes a point that fits into nine tenths of what is left of the budget; effects are searched
/// for
///   only if that fits too; iterations end by the solver's rule or when the budget, less the predicted
///   rendering, is spent. So the end comes at most one iteration and the error of that prediction after the
///   budget;
/// - before a run that searches for effects comes a quick one without, and where time is left after it one on
/// the
///   same grid without: the result has the lowest validation error of them;
/// - where not even the quickest point fits, the reference run itself is the result;
/// - a target that was missed is tried again, at most twice, with more voxels, by the front as rescaled by
/// what
///   the run itself took and reached; the best run is the result.
Result<Outcome> run_planned(const Task& task, const ReconstructOptions& options, const Progress& progress);

}  // namespace emberlock::recon
