// The default solver: non-negative least squares with the exact adjoint, coarse to fine.
#include <algorithm>
#include <limits>

#include "recon/adjust/descent.h"
#include "recon/adjust/tracker.h"

namespace emberlock {
namespace {

constexpr int kCoarsest = 24;  // no level has fewer voxels along its longest side, unless the grid itself has
constexpr int kCoarseSteps = 64;     // of a coarse level
constexpr int kMostSteps = 192;      // at full resolution, unless the user asks for more
constexpr int kRound = 16;           // steps between two looks at the held-out pixels' error
constexpr double kLeastGain = 0.05;  // a round that lowers it by a smaller share is the last

int longest(const Grid& g) { return std::max({g.nx, g.ny, g.nz}) - 1; }

}  // namespace

Solution solve_standard(const SolverSetup& setup, Tracker& tracker) {
  std::vector<Hull> hulls = {setup.hull};
  while (longest(hulls.back().grid) >= 2 * kCoarsest) hulls.push_back(coarsen(hulls.back()));

  std::unique_ptr<const Level> level;
  std::unique_ptr<Descent> descent;
  for (std::size_t l = hulls.size(); l-- > 0;) {
    auto finer = std::make_unique<const Level>(pose_level(setup, hulls[l], 1 << l));
    auto next = std::make_unique<Descent>(*finer, absorbing_optics(setup.sigma(hulls[l].grid)),
                                          setup.options.precision, setup.device, setup.pool);
    if (descent) next->start_from(refine(descent->engine().get(), level->problem, finer->problem));
    descent = std::move(next);
    level = std::move(finer);
    for (int s = 0; l > 0 && s < kCoarseSteps && !tracker.out_of_time(); s += level->subsets) descent->pass();
  }

  const ErrorOverBoxes error(setup.views, setup.boxes, level->problem);
  const int most = setup.options.iterations > 0 ? setup.options.iterations : kMostSteps / level->subsets;
  double last = std::numeric_limits<double>::infinity();
  int iteration = 0;
  while (iteration < most) {
    descent->pass();
    ++iteration;
    const double validation = descent->validation_error();
    if (tracker.record(iteration, error(descent->engine().residuals()), descent->engine(), level->problem))
      break;
    if (iteration * level->subsets % kRound != 0) continue;
    if (setup.options.iterations == 0 && validation > (1 - kLeastGain) * last) break;
    last = validation;
  }
  return {descent->engine().get(), level->problem, iteration};
}

}  // namespace emberlock
