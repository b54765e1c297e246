// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "recon/adjust/descent.h"

namespace emberlock::recon {

/// The result of a fixed number of steps on a level, from zero initialisation, for comparing candidates.
struct ColdSolve {
  double error = 0;  ///< RMS over the level's held-out pixels, grey levels; infinite if it diverged
  std::shared_ptr<const Engine> engine;  ///< holds the solution; null if it diverged
};

/// `extinction`: none, constant, or the initial value of a field. Under a light (setup.effects.light) a
/// field, what is solved for is the density alone.
ColdSolve cold_solve(const SolverSetup& setup, const Level& level, const Extinction& extinction);

}  // namespace emberlock::recon
