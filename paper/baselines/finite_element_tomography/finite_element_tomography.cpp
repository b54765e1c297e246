// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/finite_element_tomography/finite_element_tomography.h"

#include <cmath>
#include <functional>
#include <limits>

#include "paper/baselines/finite_element_tomography/element_basis.h"
#include "paper/baselines/left_out_views.h"
#include "paper/baselines/penalties.h"

namespace emberlock::paper {
namespace {

constexpr int kMostSearchedVoxels = 64;  // along the longest side of the grid that settings are sought on
constexpr std::size_t kViewsLeftOut = 3;
constexpr int kMostSteps = 100;
constexpr double kLeastStep = 1e-3;

struct Elements {
  int spacing = 1;    ///< of the nodes, voxel edges
  double weight = 0;  ///< of their roughness, over the mean of (A B)^T A B 1
};

/// The emission at the projector's key points.
Fit fit_elements(const LinearProjector& projector, const Elements& elements,
                 const std::function<bool()>& stop) {
  const ElementBasis basis(projector, elements.spacing);
  const ElementMap map(projector, basis);
  Roughness penalty(basis.nodes(), elements.weight * mean_curvature(map, basis.nodes()), projector.pool());
  const Fit fit = minimise(map, penalty, kMostSteps, kLeastStep, stop);
  Fit result{{}, fit.iterations};
  basis.spread(fit.x, result.x);
  return result;
}

/// The spacing is widened until that shows the views left out worse, each with its own best weight.
Elements find_elements(const TomographyInput& input, const MethodOptions& options, recon::Pool& pool) {
  constexpr double kLeastWeight = 4e-5;
  constexpr double kFactor = 8;
  constexpr int kMostWeights = 6;
  constexpr int kWidest = 6;
  const LeftOutViews views(input, stride_for(input), kViewsLeftOut, pool);
  Elements best;
  double least = std::numeric_limits<double>::infinity();
  for (int spacing = 1; spacing <= kWidest; ++spacing) {
    const double before = least;
    best_of(kLeastWeight, kFactor, kMostWeights, [&](double weight) {
      const Elements elements{spacing, weight};
      const double error = views.error(
          [&](const LinearProjector& fitted) { return fit_elements(fitted, elements, options.stop).x; });
      if (error < least) {
        least = error;
        best = elements;
      }
      return error;
    });
    if (!(least < before)) break;
  }
  return best;
}

}  // namespace

Result<MethodResult> finite_element_tomography(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 2));
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  const TomographyInput searched = coarse_input(input, kMostSearchedVoxels);
  Elements elements = find_elements(searched, options, pool);
  elements.spacing *= static_cast<int>(std::lround(searched.hull.grid.edge / input.hull.grid.edge));
  const LinearProjector projector(input.views, input.hull, stride_for(input), pool);
  const Fit fit = fit_elements(projector, elements, options.stop);
  return conclude(input, projector, fit.x, fit.iterations);
}

}  // namespace emberlock::paper
