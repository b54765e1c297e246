// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/adjust/tracker.h"
#include "recon/hull/hull.h"
#include "recon/views/flame_mask.h"
#include "tests/support/results.h"

// Solves whose success a test takes for granted, on the device of the test.
namespace emberlock::recon {

inline SolveOptions solve_options(int iterations, Solver solver = Solver::standard) {
  SolveOptions options;
  options.iterations = iterations;
  options.solver = solver;
  return options;
}

/// With a number of voxels along the box's longest edge.
inline Reconstruction solved_on(const Scene& scene, int voxels, const Effects& effects = {},
                                const SolveOptions& options = {}) {
  return value_of(solve(scene, grid_over(scene.box, voxels), effects, options));
}

/// Grey levels, all channels, at the end of the trace.
inline double held_out_error(const Reconstruction& r) { return all_channels(r.trace.back().heldout_rmse); }
inline double input_error(const Reconstruction& r) { return all_channels(r.trace.back().input_rmse); }

/// Calls look(setup) with the scene as the solver sets it up, in its hull.
template <class Look>
auto with_setup(const Scene& scene, int voxels, const SolveOptions& options, Pool& pool, const Look& look) {
  const std::vector<FlameMask> masks = flame_masks(scene, {}, options.compute);
  const Hull hull = value_of(carve(scene, masks, grid_over(scene.box, voxels), options.compute));
  SolverSetup setup{{}, {}, hull, {}, options, pool};
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    if (scene.views[v].role != ViewRole::input) continue;
    setup.views.push_back(&scene.views[v]);
    setup.boxes.push_back(masks[v].box);
  }
  return look(setup);
}

}  // namespace emberlock::recon
