// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/adjust/solver.h"
#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// What a joint solve did.
struct JointSolve {
  int iterations = 0;            ///< costs that were looked at after the start's; 0: there was none
  double before = 0, after = 0;  ///< the cost, see GlowCost
  double last_drop = 0;          ///< the share by which the last step that counts lowered it
  double moved = 0;              ///< RMS by which it changed temperatures, weighted by emission, K
  Seconds time{0};
};

/// Whether GlowCost describes what pictures show under such effects: straight rays, a short exposure, and no
/// light that was scattered.
bool can_solve_together(const Effects& effects);

/// Seeks temperature and brightness of all voxels that tell a temperature together, by the pictures of the
/// input views: accelerated descent of a GlowCost. `kelvin`, at key points and 0 where not told, is where it
/// starts and becomes the result, which costs no more; other light stays as it is. On the CPU, the same bits
/// for every number of threads. Of the options those of the march, the threads and `stop` count: that ends it
/// with the best so far. `scene` is one that solve() took. Throws Diverged where the cost isn't finite; then
/// `kelvin` is as it was.
JointSolve solve_together(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                          const SolveOptions& options, const Elapsed& elapsed, std::vector<float>& kelvin);

}  // namespace emberlock::recon
