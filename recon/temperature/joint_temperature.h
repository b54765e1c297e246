// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "recon/adjust/solver.h"
#include "recon/temperature/emitter.h"
#include "recon/temperature/glow_cost.h"

namespace emberlock::recon {

/// Voxels whose readings are noise alone show a view that was left out as well as their mean does: noise of
/// one voxel is the next one's on a ray's way. So the joint solve may be a little worse there; where the
/// temperatures aren't as smooth as it takes them to be, it is worse by more (recon/README.md).
inline constexpr double kMostLeftOutMisfit = 1.025;

/// What a joint solve did.
struct JointSolve {
  int iterations = 0;            ///< costs that were looked at after the start's; 0: there was none
  double before = 0, after = 0;  ///< the cost, see GlowCost
  double last_drop = 0;          ///< the share by which the last step that counts lowered it
  double moved = 0;              ///< RMS by which it changed temperatures, weighted by emission, K
  /// With some views left out of it all, what its temperatures leave of these views over what those leave
  /// that were read voxel by voxel (Misfits). Nothing where that couldn't be told.
  std::optional<double> left_out;
  [[nodiscard]] bool is_believed() const { return left_out && *left_out < kMostLeftOutMisfit; }
  Seconds time{0};
};

/// Whether GlowCost describes what pictures show under such effects: straight rays, a short exposure, and no
/// light that was scattered.
bool can_solve_together(const Effects& effects);

/// Seeks temperature and brightness of all voxels that tell a temperature together, by the pictures of the
/// input views: accelerated descent of a GlowCost. `glow`, at key points and 0 K where not told, is where it
/// starts and becomes the result, which costs no more; other light stays as it is. On the CPU, the same bits
/// for every number of threads. Of the options those of the march, the threads and `stop` count: that ends it
/// with the best so far. `scene` is one that solve() took. Throws Diverged where the cost isn't finite; then
/// `glow` is as it was.
JointSolve solve_together(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                          const SolveOptions& options, const Elapsed& elapsed, GlowField<float>& glow);

/// What two glows of the same key points leave of a scene's input views: the sum over rays of r^T P r, P the
/// inverse of the covariance of what the first leaves.
struct Misfits {
  double first = 0, second = 0;
};
Misfits misfits(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                const SolveOptions& options, const GlowField<float>& first, const GlowField<float>& second);

}  // namespace emberlock::recon
