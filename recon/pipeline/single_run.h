// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/pipeline/reconstruct.h"

namespace emberlock::recon {

/// What every step of one reconstruct() shares.
struct Task {
  PreparedScene prepared;  ///< with cameras put right, under what is known of its effects
  Device device;           ///< cpu or cuda
  Elapsed elapsed;         ///< since reconstruct() began
  const std::function<void(const Preview&)>& preview;
  [[nodiscard]] const Scene& scene() const { return prepared.told(); }
};

/// Of this machine, in bytes.
double physical_memory();

/// The grid over the scene's box; without voxels the finest that is chosen unasked. Errors: out of range, or
/// larger than `memory` for what `options` ask for, by precision and errors.
Result<Grid> choose_grid(const Scene& scene, const ReconstructOptions& options,
                         const std::optional<int>& voxels, double memory = physical_memory());

/// Those that are set by hand, for runs that only tell of time: but a light, which must be found first.
Effects told_effects(const ReconstructOptions& options);

/// Those that are asked for, and of the others those that the scene calls for.
Result<EffectChoice> decide_effects(const Task& task, const Grid& grid, const ReconstructOptions& options);

/// Effects, hull, solve and rendering, at settings that stay as they are.
Result<Outcome> run_once(const Task& task, const ReconstructOptions& options, const Progress& progress);

/// Renders every view of the scene that was solved, and judges it; fills the report but its input and plan.
Outcome finish(const Task& task, const PreparedScene& solved, const SolveOptions& options,
               Reconstruction done, const Progress& progress);

/// Whether the volume explains a tenth of the light that the input views show, each view counting the same;
/// warns of each view of which it doesn't. Error: not_converged, which names those views.
Status check_explained(Report& report);

}  // namespace emberlock::recon
