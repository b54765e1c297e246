// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/reference_run.h"

#include <algorithm>

#include "recon/adjust/descent.h"
#include "recon/adjust/picture_error.h"
#include "recon/render/render.h"

namespace emberlock::recon {
namespace {

constexpr int kShare =
    8;  // of the finest grid's voxels; an eighth costs little and shows the flame's outline
constexpr int kLeast = 8;
constexpr int kIterations = 2;

}  // namespace

int reference_voxels(int finest) { return std::max(kLeast, finest / kShare); }

Result<Reference> measure_reference(const PreparedScene& scene, const Grid& grid, const SolveOptions& options,
                                    const Elapsed& elapsed) {
  SolveOptions coarse = options;
  coarse.solver = Solver::standard;
  coarse.iterations = options.iterations > 0 ? std::min(options.iterations, kIterations) : kIterations;
  coarse.target_rmse.reset();
  if (!coarse.smoothness) coarse.smoothness = kLeastSmoothness;  // a yardstick searches for nothing
  Reference reference;
  EMBERLOCK_ASSIGN_OR_RETURN(reference.reconstruction, solve(scene, grid, coarse, elapsed));
  const Reconstruction& done = reference.reconstruction;
  reference.seconds = done.hull_time + done.solve_time;
  const std::vector<View>& views = scene.told().views;
  const auto held_out =
      std::find_if(views.begin(), views.end(), [](const View& v) { return v.role == ViewRole::held_out; });
  const bool any = held_out != views.end();
  if (!done.trace.empty()) {
    const TracePoint& last = done.trace.back();
    reference.error = all_channels(any ? last.heldout_rmse : last.input_rmse);
  }
  const Seconds start = elapsed();
  render_view(done.volume, done.hull, done.effects, (any ? *held_out : views.front()).camera,
              RenderOptions{.compute = options.compute});
  reference.seconds_to_render = elapsed() - start;
  return reference;
}

}  // namespace emberlock::recon
