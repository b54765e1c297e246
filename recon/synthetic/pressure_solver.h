// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "recon/synthetic/fluid_work.h"

namespace emberlock::recon {

/// Solves the equation of recon/kernels/fluid_pressure.h by conjugate gradients with a multigrid V-cycle as
/// preconditioner (McAdams, Sifakis and Teran 2010): red-black Gauss-Seidel, trilinear prolongation, sums as
/// restriction. As that pair isn't symmetric, the directions are those of Polak and Ribiere. Numbers are
/// float, sums double; the residual is that of the recursion. Allocates nothing while it solves.
class PressureSolver {
 public:
  /// Cells that are even along each axis are coarsened until one of them is not, or is 4 or fewer. `work`
  /// outlives this.
  PressureSolver(const FluidGrid& grid, FluidWork& work);

  /// The faces' a_f of the finest grid are to be written here, then prepare() makes the others.
  [[nodiscard]] const PressureEquation& equation() const { return levels_.front().equation; }
  void prepare();

  struct Outcome {
    int iterations = 0;
    double residual = 0;  ///< rms of the residual over that of b; 0 if b is 0
  };
  /// Replaces b() by the residual and q() by the solution from q = 0. Stops at `tolerance` of b, or after
  /// `iterations`.
  Outcome solve(double tolerance, int iterations);
  [[nodiscard]] float* b() { return r_.data(); }
  [[nodiscard]] const float* q() const { return x_.data(); }
  [[nodiscard]] std::vector<float> solution() const { return x_.values(); }

 private:
  struct Level {
    PressureEquation equation;
    FluidArray<float> a[3], inverse_diagonal, q, b;
  };
  void precondition();
  void relax(const Level& level, const float* b, float* q, int first_colour);
  void solve_coarsest(const Level& level, const float* b, float* q);

  FluidWork& work_;
  std::vector<Level> levels_;
  FluidArray<float> r_, x_, d_, image_;
};

}  // namespace emberlock::recon
