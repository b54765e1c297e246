// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/adjust/solver.h"
#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// What a joint solve did.
struct JointSolve {
  int iterations = 0;            ///< 0: there was none
  double before = 0, after = 0;  ///< the cost, see GlowCost
  double moved = 0;              ///< RMS by which it changed temperatures, weighted by emission, K
  Seconds time{0};
};

/// Whether GlowCost describes what pictures show under such effects: straight rays, a short exposure, and no
/// light that was scattered.
bool can_solve_together(const Effects& effects);

/// Seeks temperature and brightness of all voxels that tell a temperature together, by the pictures of the
/// input views: accelerated descent of a GlowCost. `kelvin`, at key points and 0 where not told, is where it
/// starts and becomes the result, which costs no more; other light stays as it is. On the CPU, the same bits
/// for every number of threads. `scene` is one that solve() took. Throws Diverged where the cost isn't
/// finite.
JointSolve solve_together(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                          const ComputeOptions& compute, const Elapsed& elapsed, std::vector<float>& kelvin);

}  // namespace emberlock::recon
