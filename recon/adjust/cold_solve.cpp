// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/cold_solve.h"

#include <cmath>
#include <limits>
#include <optional>

#include "recon/adjust/lit_descent.h"

namespace emberlock::recon {
namespace {

// Emission only, then emission and extinction together; without extinction to find, both.
constexpr int kEmissionSteps = 8;
constexpr int kJointSteps = 16;
constexpr int kLitPasses = 16;  // of a density, whose light is found with it

/// Candidates are compared across levels, whose numbers of subsets differ: a level of fewer subsets needs
/// more passes for as many steps.
void take_steps(Descent& descent, const Level& level, int steps) {
  for (int taken = 0; taken < steps; taken += level.subsets) descent.pass();
}

ColdSolve finish(Descent& descent, const Level& level, int steps) {
  take_steps(descent, level, steps);
  descent.show_validation();
  const double error = descent.validation_error();
  if (!std::isfinite(error)) throw Diverged(error, error);
  return {error, descent.take_engine()};
}

/// `density`: what is expected of it, spread by the light that there is.
ColdSolve solve_lit_level(const SolverSetup& setup, const Level& level, const Extinction& density) {
  const LitStart glow(level, setup, density);
  LitDescent descent(level, setup, glow.start());
  descend(descent, kLitPasses);
  descent.judge();
  const double error = descent.validation_error();
  if (!std::isfinite(error)) throw Diverged(error, error);
  return {error, descent.take_engine()};
}

ColdSolve solve_level(const SolverSetup& setup, const Level& level, const Extinction& extinction) {
  if (setup.effects.light.source != Light::Source::none) return solve_lit_level(setup, level, extinction);
  const Problem& problem = level.problem;
  Optics optics = setup.optics(problem.grid());
  if (extinction.model == Extinction::Model::none) {
    optics.absorb = Absorb::nothing;
    Descent descent(level, optics, setup);
    return finish(descent, level, kEmissionSteps + kJointSteps);
  }
  if (extinction.model == Extinction::Model::constant) {
    SolverSetup even = setup;
    even.effects.extinction = extinction;
    Descent descent(level, even.optics(problem.grid()), even);
    return finish(descent, level, kEmissionSteps + kJointSteps);
  }
  optics.absorb = Absorb::field;
  std::optional<Descent> even;
  if (extinction.soot.value() > 0) {  // is spread by the light that there is
    even.emplace(level, optics, setup, DescentStart{nullptr, &extinction});
    take_steps(*even, level, kEmissionSteps);
  }
  Descent descent(level, optics, setup, {even ? &even->engine() : nullptr, &extinction});
  even.reset();
  take_steps(descent, level, kEmissionSteps);
  descent.release_extinction();
  return finish(descent, level, kJointSteps);
}

}  // namespace

ColdSolve cold_solve(const SolverSetup& setup, const Level& level, const Extinction& extinction) try {
  return solve_level(setup, level, extinction);
} catch (const Diverged&) {
  return {std::numeric_limits<double>::infinity(), nullptr};
}

}  // namespace emberlock::recon
