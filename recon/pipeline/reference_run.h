// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/result.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

/// The yardstick of reference fronts: a coarse solve of the scene at hand, which takes in the machine's
/// speed, the pictures' size and how hard the flame is.
struct Reference {
  Reconstruction reconstruction;
  Seconds seconds{0};            ///< hull and solve
  Seconds seconds_to_render{0};  ///< one view
  double error = 0;  ///< of the held-out views, of the input views where none is held out; all channels
};

/// Voxels of a reference on a scene whose pictures call for `finest` (finest_voxels()).
int reference_voxels(int finest);

/// Takes step, precision, device, threads, threshold, budget and a limit of iterations from `options`.
/// Errors: those of solve().
Result<Reference> measure_reference(const PreparedScene& scene, const Grid& grid, const SolveOptions& options,
                                    const Elapsed& elapsed);

}  // namespace emberlock::recon
