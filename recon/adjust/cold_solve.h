// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/adjust/descent.h"

namespace emberlock::recon {

/// What a few passes from darkness make of a level, for comparing candidates.
struct ColdSolve {
  double error = 0;     ///< RMS over the level's held-out pixels, grey levels; infinite where it diverged
  std::vector<Rgba> x;  ///< as Engine::get()
};

/// `extinction`: none, constant, or a field's first guess.
ColdSolve cold_solve(const SolverSetup& setup, const Level& level, const Extinction& extinction);

}  // namespace emberlock::recon
