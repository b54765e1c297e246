// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/regularised_tomography/regularised_tomography.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "paper/baselines/left_out_views.h"
#include "paper/baselines/penalties.h"

namespace emberlock::paper {
namespace {

constexpr int kMostSearched = 64;  // voxels along the longest side of the grid that weights are sought on
constexpr std::size_t kMostLeftOut = 3;
constexpr int kSearchIterations = 100;
constexpr int kMostIterations = 150;
constexpr double kLeastChange = 1e-3;

/// A penalty whose weight has no unit: `weight` times what A itself weighs.
using MakePenalty = std::unique_ptr<Penalty> (*)(const LinearProjector& projector, const Lattice& lattice,
                                                 double weight);

std::unique_ptr<Penalty> roughness(const LinearProjector& projector, const Lattice& lattice, double weight) {
  return std::make_unique<Roughness>(lattice, weight * mean_curvature(projector, lattice), projector.pool());
}

std::unique_ptr<Penalty> variation(const LinearProjector& projector, const Lattice& lattice, double weight) {
  return std::make_unique<Variation>(lattice, variation_weights(projector, weight), projector.pool());
}

struct Regularisation {
  MakePenalty make = nullptr;
  double least = 0;  ///< the first weight that is tried, on the coarse grid
  double power = 0;  ///< the weight of one and the same R falls with the voxel edge to the power of that
};

double find_weight(const TomographyInput& input, const Regularisation& by, const MethodOptions& options,
                   recon::Pool& pool) {
  constexpr double kFactor = 4;
  constexpr int kMostWeights = 10;
  const LeftOutViews views(input, stride_for(input), kMostLeftOut, pool);
  return best_of(by.least, kFactor, kMostWeights, [&](double weight) {
    return views.error([&](const LinearProjector& fitted) {
      const Lattice lattice = lattice_of(fitted);
      const std::unique_ptr<Penalty> penalty = by.make(fitted, lattice, weight);
      return minimise(fitted, *penalty, kSearchIterations, kLeastChange, options.stop).x;
    });
  });
}

Result<MethodResult> solve_regularised(const recon::Scene& scene, const MethodOptions& options,
                                       const Regularisation& by) {
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 2));
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  const TomographyInput searched = coarse_input(input, kMostSearched);
  const double weight = find_weight(searched, by, options, pool);
  const auto finer = static_cast<double>(searched.hull.grid.edge / input.hull.grid.edge);
  const LinearProjector projector(input.views, input.hull, stride_for(input), pool);
  const Lattice lattice = lattice_of(projector);
  const std::unique_ptr<Penalty> penalty = by.make(projector, lattice, weight * std::pow(finer, by.power));
  const Fit fit = minimise(projector, *penalty, kMostIterations, kLeastChange, options.stop);
  return conclude(input, projector, fit.x, fit.iterations);
}

}  // namespace

Result<MethodResult> tikhonov_tomography(const recon::Scene& scene, const MethodOptions& options) {
  return solve_regularised(scene, options, {roughness, 4e-5, 4});
}

Result<MethodResult> total_variation_tomography(const recon::Scene& scene, const MethodOptions& options) {
  return solve_regularised(scene, options, {variation, 1.6e-4, 1});
}

}  // namespace emberlock::paper
