// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/planned_time.h"

#include <algorithm>

#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reference_front.h"

namespace emberlock::recon {
namespace {

constexpr int kLeastCoarse = 8;  // voxels of the coarse run

}  // namespace

Result<PlannedTime> plan_time(const Task& task, const ReconstructOptions& options, const Progress& progress) {
  const Seconds start = task.elapsed();
  tell(progress, 0, "finding out which effects matter");
  EMBERLOCK_ASSIGN_OR_RETURN(const Grid grid, choose_grid(task.scene(), options, options.voxels));
  PlannedTime planned;
  EMBERLOCK_ASSIGN_OR_RETURN(planned.effects, decide_effects(task, grid, options));
  const Seconds decided = task.elapsed();
  planned.searching = decided - start;
  tell(progress, 0.3, "measuring this machine on a grid half as fine");
  const int voxels = std::max({grid.nx, grid.ny, grid.nz}) - 1;
  const int coarse = std::min(voxels, std::max(kLeastCoarse, voxels / 2));
  const PreparedScene scene = task.prepared.under(planned.effects.effects);
  EMBERLOCK_ASSIGN_OR_RETURN(Reconstruction done,
                             solve(scene, grid_over(task.scene().box, coarse), options.solve, task.elapsed));
  finish(task, scene, options.solve, std::move(done), {});
  const bool absorbs = planned.effects.effects.extinction.model != Extinction::Model::none;
  const auto reference = [&](int v) {
    return seconds_at(reference_solves(), absorbs ? "auto" : "none", finest_voxels(task.scene()), v);
  };
  planned.solving = (task.elapsed() - decided) * (reference(voxels) / reference(coarse));
  return planned;
}

}  // namespace emberlock::recon
