// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/reference_run.h"

#include <algorithm>

#include "recon/adjust/descent.h"
#include "recon/preprocess/flame_mask.h"
#include "recon/render/render.h"

namespace emberlock::recon {
namespace {

constexpr int kShare =
    8;  // of the finest grid's voxels; an eighth costs little and shows the flame's outline
constexpr int kLeast = 8;
constexpr int kIterations = 2;

}  // namespace

int reference_voxels(int finest) { return std::max(kLeast, finest / kShare); }

Result<Reference> measure_reference(const Scene& scene, const Grid& grid, const Effects& effects,
                                    const SolveOptions& options, const Elapsed& elapsed) {
  SolveOptions coarse = options;
  coarse.solver = Solver::standard;
  coarse.iterations = options.iterations > 0 ? std::min(options.iterations, kIterations) : kIterations;
  coarse.target_rmse.reset();
  if (!coarse.smoothness) coarse.smoothness = kLeastSmoothness;  // a yardstick searches for nothing
  Reference reference;
  EMBERLOCK_ASSIGN_OR_RETURN(reference.reconstruction, solve(scene, grid, effects, coarse, elapsed));
  const Reconstruction& done = reference.reconstruction;
  reference.seconds = done.hull_time + done.solve_time;
  const auto judged = std::find_if(scene.views.begin(), scene.views.end(),
                                   [](const View& v) { return v.role == ViewRole::held_out; });
  const bool any = judged != scene.views.end();
  if (!done.trace.empty()) {
    const TracePoint& last = done.trace.back();
    reference.error = all_channels(any ? last.heldout_rmse : last.input_rmse);
  }
  const Seconds start = elapsed();
  render_view(done.volume, done.hull, done.effects, (any ? *judged : scene.views.front()).camera,
              RenderOptions{.compute = options.compute});
  reference.seconds_to_render = elapsed() - start;
  return reference;
}

}  // namespace emberlock::recon
