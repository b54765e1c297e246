// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/stochastic_tomography/stochastic_tomography.h"

#include <vector>

#include "paper/baselines/left_out_views.h"
#include "paper/baselines/penalties.h"
#include "paper/baselines/stochastic_tomography/random_walk.h"

namespace emberlock::paper {
namespace {

constexpr int kCoarse = 64;  // voxels along the longest side of the grid that the weight is sought on
constexpr std::size_t kFewViews = 2;
constexpr int kMostPasses = 200;

Fit walk(const LinearProjector& projector, double weight, const MethodOptions& options) {
  const Lattice lattice = lattice_of(projector);
  const Footprints prints = footprints_of(projector);
  const Channels weights = variation_weights(projector, weight);
  std::vector<RandomWalk> walks;
  walks.reserve(3);
  for (int c = 0; c < 3; ++c)
    walks.emplace_back(lattice, prints, projector.seen(), c, weights[static_cast<std::size_t>(c)],
                       options.seed);
  Fit fit{Light(projector.unknowns()), 0};
  const auto all_done = [&] { return walks[0].is_done() && walks[1].is_done() && walks[2].is_done(); };
  do {
    projector.pool().run(3, [&](int c) {
      RandomWalk& mine = walks[static_cast<std::size_t>(c)];
      if (!mine.is_done()) mine.pass();
    });
    ++fit.iterations;
  } while (fit.iterations < kMostPasses && !all_done() && !(options.stop && options.stop()));
  for (int c = 0; c < 3; ++c)
    for (std::size_t p = 0; p < fit.x.size(); ++p) fit.x[p].c[c] = walks[static_cast<std::size_t>(c)].x()[p];
  return fit;
}

double find_variation(const TomographyInput& input, const MethodOptions& options, recon::Pool& pool) {
  constexpr double kLeastWeight = 3.2e-4;
  constexpr double kFactor = 4;
  constexpr int kMostWeights = 8;
  const LeftOutViews views(input, stride_for(input), kFewViews, pool);
  return best_of(kLeastWeight, kFactor, kMostWeights, [&](double weight) {
    return views.error([&](const LinearProjector& fitted) { return walk(fitted, weight, options).x; });
  });
}

}  // namespace

Result<MethodResult> stochastic_tomography(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 2));
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  const TomographyInput searched = coarse_input(input, kCoarse);
  const double weight = find_variation(searched, options, pool);
  const auto finer = static_cast<double>(searched.hull.grid.edge / input.hull.grid.edge);
  const LinearProjector projector(input.views, input.hull, stride_for(input), pool);
  const Fit fit = walk(projector, weight * finer, options);
  return conclude(input, projector, fit.x, fit.iterations);
}

}  // namespace emberlock::paper
