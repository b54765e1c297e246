// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/pipeline/single_run.h"
#include "recon/pipeline/work_precision.h"

namespace emberlock::recon {

/// What this machine, as busy as it is now, takes for a coarse solve of the scene at hand.
struct Calibration {
  Seconds unit{
      0};  ///< of reference_ends(): a reference run's time, by the largest solve that there was time for
  Seconds took{0};  ///< all of them
};

/// Coarse solves of ever finer grids (reference_run.h), the first twice because the very first one pays for
/// the start, as long as another fits into about a second.
Result<Calibration> calibrate(const Task& task, const ReconstructOptions& options);

/// What runs without a limit would still take here, in seconds, by rising voxels; errors as multiples of one
/// and the same unknown error. From the reference front: its grids as far as they fit into the memory, and at
/// the voxels that are asked for those alone.
std::vector<WorkPoint> expected_runs(const Scene& scene, const ReconstructOptions& options,
                                     const Calibration& calibration);

/// The number of voxels: what is told; otherwise by options.rule. By the knee it measures first, and says
/// what it chose, why, and what else could be asked for. The same voxels give the same result on every
/// machine; which ones the knee takes depends on the machine, and is recorded. Errors: those of choose_grid()
/// and of solve().
Result<VoxelChoice> choose_voxels(const Task& task, const ReconstructOptions& options,
                                  const Progress& progress = {});

}  // namespace emberlock::recon
