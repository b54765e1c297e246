// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/cold_solve.h"

#include <limits>

#include "recon/adjust/extinction_field.h"

namespace emberlock::recon {
namespace {

ColdSolve finish(Descent& descent, int passes) {
  for (int p = 0; p < passes; ++p) descent.pass();
  return {descent.validation_error(), descent.engine().get()};
}

ColdSolve solve_level(const SolverSetup& setup, const Level& level, const Extinction& extinction,
                      const ColdPasses& passes) {
  const Problem& problem = level.problem;
  Optics optics = setup.optics(problem.grid());
  std::vector<Rgba> x(problem.active.size());
  if (extinction.model == Extinction::Model::none) {
    optics.absorb = Absorb::nothing;
    Descent descent(level, optics, setup, x);
    return finish(descent, passes.emission + passes.joint);
  }
  if (extinction.model == Extinction::Model::constant) {
    SolverSetup even = setup;
    even.effects.extinction = extinction;
    Descent descent(level, even.optics(problem.grid()), even, x);
    return finish(descent, passes.emission + passes.joint);
  }
  optics.absorb = Absorb::field;
  if (extinction.soot.value() > 0) {  // is spread by the light that there is
    Descent even(level, optics, setup, with_extinction(x, expected_extinction(problem, extinction, x)));
    for (int p = 0; p < passes.emission; ++p) even.pass();
    x = even.engine().get();
  }
  Descent descent(level, optics, setup, with_extinction(x, expected_extinction(problem, extinction, x)));
  for (int p = 0; p < passes.emission; ++p) descent.pass();
  descent.release_extinction();
  return finish(descent, passes.joint);
}

}  // namespace

ColdSolve cold_solve(const SolverSetup& setup, const Level& level, const Extinction& extinction,
                     const ColdPasses& passes) try {
  return solve_level(setup, level, extinction, passes);
} catch (const Diverged&) {
  return {std::numeric_limits<double>::infinity(), std::vector<Rgba>(level.problem.active.size())};
}

}  // namespace emberlock::recon
