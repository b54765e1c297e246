// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "base/result.h"
#include "recon/pipeline/work_precision.h"
#include "recon/views/view.h"

namespace emberlock::evaluate {

/// What a sweep tries. The first value of each list is its base: runs vary one setting at a time around the
/// base, and cross voxels with effects, the two that matter most. Empty lists are filled in by
/// sweep_defaults().
struct SweepOptions {
  std::vector<int> voxels;
  std::vector<int> views;       ///< input views; 0: all
  std::vector<int> iterations;  ///< points of each run's trace; the last is as far as a run goes
  std::vector<double> steps;
  std::vector<recon::Precision> precisions;
  std::vector<std::string> effects;
  std::vector<recon::Solver> solvers;
  bool one_at_a_time = true;  ///< otherwise the cross of voxels and effects alone
  recon::ComputeOptions compute;
  std::optional<Seconds> budget;  ///< for the whole sweep
};

/// The paper's solver needs more iterations for the same: its runs take so many times those of the list.
inline constexpr int kPaperIterations = 8;

/// Fills empty lists for this scene and puts them in order: iterations rising, each value once.
SweepOptions sweep_defaults(SweepOptions options, const recon::Scene& scene);

/// The runs of a sweep whose lists are full, most telling first; each goes as far as the last iteration.
std::vector<recon::Settings> sweep_runs(const SweepOptions& options);

struct Sweep {
  std::vector<recon::WorkPoint> points;  ///< in the order of the runs; several for each
  std::vector<std::size_t> run;          ///< of each point: which of sweep_runs()
  /// Runs that didn't happen or failed, and points that aren't any better than no light, each with the
  /// reason.
  std::vector<std::string> skipped;
  Seconds total{0};
};

/// Every run by reconstruct(). A point's seconds are those until its iteration, and the rendering of the
/// views. A run that fails on its own (memory) is skipped; the budget stops the sweep between runs and inside
/// them. Errors: no held-out view, values out of range, and when no run at all succeeds its error.
Result<Sweep> sweep(const recon::Scene& scene, const SweepOptions& options, const Clock& clock,
                    const Progress& progress = {});

}  // namespace emberlock::evaluate
