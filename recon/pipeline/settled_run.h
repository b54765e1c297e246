// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "recon/pipeline/reconstruct.h"

namespace emberlock::recon {

/// What every step of one reconstruct() shares.
struct Task {
  const Scene& scene;  ///< checked
  Device device;       ///< cpu or cuda
  Elapsed elapsed;     ///< since reconstruct() began
  const std::function<void(const Preview&)>& preview;
};

/// Of this machine, in bytes.
double physical_memory();

/// The grid over the scene's box; without voxels the finest that is chosen unasked. Errors: out of range, or
/// larger than `memory`.
Result<Grid> choose_grid(const Scene& scene, const std::optional<int>& voxels,
                         Precision precision = Precision::float32, double memory = physical_memory());

/// Effects, hull, solve and rendering, at settings that stay as they are.
Result<Outcome> run_settled(const Task& task, const ReconstructOptions& options, const Progress& progress);

/// Renders every view and judges it; fills the report but its input and plan.
Outcome finish(const Task& task, const SolveOptions& options, Reconstruction done, const Progress& progress);

}  // namespace emberlock::recon
