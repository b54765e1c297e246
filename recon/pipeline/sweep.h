// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/clock.h"
#include "base/progress.h"
#include "base/result.h"
#include "recon/pipeline/work_precision.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// What a sweep tries. The first value of each list is its base: runs vary one setting at a time around the
/// base, and cross voxels with effects, the two that matter most. Empty lists are filled in by
/// sweep_defaults().
struct SweepOptions {
  std::vector<int> voxels;
  std::vector<int> views;       ///< input views; 0: all
  std::vector<int> iterations;  ///< points of each run's trace; the last is as far as a run goes
  std::vector<double> steps;
  std::vector<Precision> precisions;
  std::vector<std::string> effects;
  std::vector<Solver> solvers;
  bool one_at_a_time = true;  ///< otherwise the cross of voxels and effects alone
  ComputeOptions compute;
  std::optional<Seconds> budget;  ///< for the whole sweep
};

/// The paper's solver needs more iterations for the same: its runs take so many times those of the list.
inline constexpr int kPaperIterations = 8;

/// Fills empty lists for this scene and puts them in order: iterations rising, each value once.
SweepOptions sweep_defaults(SweepOptions options, const Scene& scene);

/// The runs of a sweep whose lists are full, most telling first; each goes as far as the last iteration.
std::vector<Settings> sweep_runs(const SweepOptions& options);

/// The scene with `count` of its input views, spread as far as possible (greedily, by the angle between lines
/// of sight), and all held-out ones; the scene itself with 0, or with as many as there are.
Scene with_views(const Scene& scene, int count);

struct Sweep {
  std::vector<WorkPoint> points;     ///< in the order of the runs; several for each
  std::vector<std::size_t> run;      ///< of each point: which of sweep_runs()
  std::vector<std::string> skipped;  ///< runs that didn't happen, each with the reason
  Seconds total{0};
};

/// Every run by reconstruct(). A point's seconds are those until its iteration, and the rendering of the
/// views. A run that fails on its own (memory) is skipped; the budget stops the sweep between runs and inside
/// them. Errors: no held-out view, values out of range, and when no run at all succeeds its error.
Result<Sweep> sweep(const Scene& scene, const SweepOptions& options, const Clock& clock,
                    const Progress& progress = {});

}  // namespace emberlock::recon
