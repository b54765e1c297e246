// SPDX-License-Identifier: Apache-2.0
#include "paper/methods.h"

#include <string>
#include <utility>

#include <fmt/format.h>

#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"
#include "paper/baselines/appearance_transfer/appearance_transfer.h"
#include "paper/baselines/colour_temperature/colour_temperature.h"
#include "paper/baselines/finite_element_tomography/finite_element_tomography.h"
#include "paper/baselines/gaussian_splats/gaussian_splats.h"
#include "paper/baselines/refractive_reconstruction/refractive_reconstruction.h"
#include "paper/baselines/regularised_tomography/regularised_tomography.h"
#include "paper/baselines/sheet_decomposition/sheet_decomposition.h"
#include "paper/baselines/stochastic_tomography/stochastic_tomography.h"
#include "paper/baselines/two_colour_pyrometry/two_colour_pyrometry.h"
#include "recon/adjust/choose_effects.h"
#include "recon/adjust/solver.h"
#include "recon/export/temperature_look_up.h"
#include "recon/temperature/temperature.h"

namespace emberlock::paper {
namespace {

recon::SolveOptions solve_options(const MethodOptions& options) {
  recon::SolveOptions solve;
  solve.compute = options.compute;
  solve.seed = options.seed;
  solve.stop = options.stop;
  return solve;
}

MethodResult result_of(recon::Reconstruction done) {
  return {std::move(done.volume), std::move(done.hull), done.effects, done.iterations};
}

/// What is on, and why the extinction is or isn't.
std::string words(const std::vector<recon::EffectReport>& reports) {
  std::string on;
  for (const recon::EffectReport& report : reports)
    if (report.on || report.name == "extinction")
      on += fmt::format("{}{} {}: {}", on.empty() ? "" : "; ", report.name, report.on ? "on" : "off",
                        report.reason);
  return on;
}

}  // namespace

recon::Effects papers_effects(const recon::Grid& grid) {
  return recon::absorbing(
      recon::extinction_of_opacity(recon::kPaperOpacityOfAStep, Meters(static_cast<double>(grid.edge))));
}

Result<MethodResult> the_papers_method(const recon::Scene& scene, const MethodOptions& options) {
  const recon::Grid grid = recon::grid_over(scene.box, options.voxels);
  recon::SolveOptions solve = solve_options(options);
  solve.solver = recon::Solver::paper;
  solve.flame_threshold = recon::kPaperFlameThreshold;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Reconstruction done,
                             recon::solve(scene, grid, papers_effects(grid), solve));
  MethodResult result = result_of(std::move(done));
  if (options.temperatures && options.response)
    result.kelvin = recon::TemperatureLookUp(*options.response, recon::Emitter::paper)
                        .read(result.volume.emission, Meters(static_cast<double>(grid.edge)));
  return result;
}

Result<MethodResult> default_method(const recon::Scene& scene, const MethodOptions& options) {
  const recon::Grid grid = recon::grid_over(scene.box, options.voxels);
  const recon::SolveOptions solve = solve_options(options);
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::EffectChoice choice, recon::choose_effects(scene, grid, {}, solve));
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Reconstruction done, recon::solve(scene, grid, choice.effects, solve));
  std::vector<float> kelvin;
  if (options.temperatures && options.response) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::VolumeErrors errors, recon::errors_by_views(scene, done, solve));
    kelvin = recon::temperature_of(scene, done, errors, *options.response, options.emitter, solve).kelvin;
  }
  MethodResult result = result_of(std::move(done));
  result.chose = words(choice.reports);
  result.kelvin = std::move(kelvin);
  return result;
}

const std::vector<Method>& methods() {
  static const std::vector<Method> all = {
      {kSheetDecompositionFacts, sheet_decomposition},
      {kAlgebraicTomographyFacts, algebraic_tomography},
      {kConvergedAlgebraicTomographyFacts, converged_algebraic_tomography},
      {kStochasticTomographyFacts, stochastic_tomography},
      {kColourTemperatureFacts, colour_temperature},
      {kTwoColourPyrometryFacts, two_colour_pyrometry},
      {kRefractiveReconstructionFacts, refractive_reconstruction},
      {kAppearanceTransferFacts, appearance_transfer},
      {kTikhonovTomographyFacts, tikhonov_tomography},
      {kTotalVariationTomographyFacts, total_variation_tomography},
      {kFiniteElementTomographyFacts, finite_element_tomography},
      {kGaussianSplatsFacts, gaussian_splats},
      {{kPapersMethod, "the paper", false, Projection::perspective, "radiative transport", true},
       the_papers_method},
      {{kDefaultMethod, "this program", false, Projection::perspective, "radiative transport", true},
       default_method},
  };
  return all;
}

Result<Method> find_method(std::string_view name) {
  std::string names;
  for (const Method& method : methods()) {
    if (method.facts.name == name) return method;
    names += (names.empty() ? "" : ", ") + std::string(method.facts.name);
  }
  return Error{ErrorKind::bad_input, "no such method", std::string(name), "Take one of " + names};
}

}  // namespace emberlock::paper
