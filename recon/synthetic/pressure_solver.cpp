// SPDX-License-Identifier: Apache-2.0
#include "recon/synthetic/pressure_solver.h"

#include <algorithm>
#include <cmath>

namespace emberlock::recon {
namespace {

constexpr int kCoarsestSweeps = 16;

bool can_coarsen(const FluidGrid& g) {
  return g.nx % 2 == 0 && g.ny % 2 == 0 && g.nz % 2 == 0 && std::min({g.nx, g.ny, g.nz}) > 4;
}

}  // namespace

PressureSolver::PressureSolver(const FluidGrid& grid, FluidWork& work) : work_(work) {
  FluidGrid g = grid;
  for (;;) {
    Level level;
    for (int axis = 0; axis < 3; ++axis) {
      level.a[axis] = work.array<float>(g.size());
      level.equation.a.axis[axis] = level.a[axis].data();
    }
    level.inverse_diagonal = work.array<float>(g.size());
    level.equation.inverse_diagonal = level.inverse_diagonal.data();
    level.equation.grid = g;
    level.q = work.array<float>(g.size());
    if (!levels_.empty()) level.b = work.array<float>(g.size());
    levels_.push_back(std::move(level));
    if (!can_coarsen(g)) break;
    g = {g.nx / 2, g.ny / 2, g.nz / 2, 2 * g.edge};
  }
  for (FluidArray<float>* array : {&r_, &x_, &d_, &image_}) *array = work.array<float>(grid.size());
}

void PressureSolver::prepare() {
  for (std::size_t l = 0; l < levels_.size(); ++l) {
    const PressureEquation& here = levels_[l].equation;
    if (l > 0) {
      const PressureEquation& fine = levels_[l - 1].equation;
      work_.faces<0>(here.grid, CoarsenCoefficients<0>{fine, here});
      work_.faces<1>(here.grid, CoarsenCoefficients<1>{fine, here});
      work_.faces<2>(here.grid, CoarsenCoefficients<2>{fine, here});
    }
    work_.cells(here.grid, InvertDiagonal{here});
  }
}

void PressureSolver::relax(const Level& level, const float* b, float* q, int first_colour) {
  const FluidGrid& g = level.equation.grid;
  const FluidRange half{(g.nx + 1) / 2, g.ny, g.nz};
  work_.each(half, RelaxColour{level.equation, b, q, first_colour});
  work_.each(half, RelaxColour{level.equation, b, q, 1 - first_colour});
}

void PressureSolver::solve_coarsest(const Level& level, const float* b, float* q) {
  work_.cells(level.equation.grid, SetZero{q, level.equation.grid});
  for (int sweep = 0; sweep < kCoarsestSweeps; ++sweep) relax(level, b, q, 0);
  for (int sweep = 0; sweep < kCoarsestSweeps; ++sweep) relax(level, b, q, 1);
}

/// One V-cycle: the finest level's q becomes about the solution for r.
void PressureSolver::precondition() {
  const std::size_t last = levels_.size() - 1;
  for (std::size_t l = 0; l < last; ++l) {
    Level& fine = levels_[l];
    Level& coarse = levels_[l + 1];
    const FluidGrid& g = fine.equation.grid;
    const float* b = l == 0 ? r_.data() : fine.b.data();
    work_.each({(g.nx + 1) / 2, g.ny, g.nz}, RelaxFirst{fine.equation, b, fine.q.data()});
    work_.cells(coarse.equation.grid,
                RestrictResidual{fine.equation, fine.q.data(), b, coarse.equation.grid, coarse.b.data()});
  }
  solve_coarsest(levels_[last], last == 0 ? r_.data() : levels_[last].b.data(), levels_[last].q.data());
  for (std::size_t l = last; l-- > 0;) {
    Level& fine = levels_[l];
    Level& coarse = levels_[l + 1];
    const FluidGrid& g = fine.equation.grid;
    work_.each({g.nx / 2, g.ny, g.nz},
               ProlongCorrection{coarse.equation.grid, coarse.q.data(), g, fine.q.data()});
    relax(fine, l == 0 ? r_.data() : fine.b.data(), fine.q.data(), 1);
  }
}

PressureSolver::Outcome PressureSolver::solve(double tolerance, int iterations) {
  const FluidGrid& g = equation().grid;
  float* z = levels_.front().q.data();
  work_.cells(g, SetZero{x_.data(), g});
  const double start = work_.sum(g, TwoProducts{r_.data(), r_.data(), r_.data()}).first;
  Outcome outcome;
  if (!(start > 0)) return outcome;
  outcome.residual = 1;
  double before = 0;
  double alpha = 0;
  while (outcome.iterations < iterations && outcome.residual > tolerance) {
    precondition();
    const FluidSums products = work_.sum(g, TwoProducts{r_.data(), image_.data(), z});
    const double now = products.first;
    if (!(now > 0)) break;
    // r changed by -alpha image_, which is that of the last direction.
    const double beta = before > 0 ? std::max(0.0, -alpha * products.second / before) : 0.0;
    work_.cells(g, NextDirection{z, d_.data(), g, static_cast<float>(beta)});
    const double curvature = work_.sum(g, ApplyEquation{equation(), d_.data(), image_.data()}).first;
    if (!(curvature > 0)) break;
    alpha = now / curvature;
    const double square =
        work_.sum(g, DescendAlong{d_.data(), image_.data(), x_.data(), r_.data(), static_cast<float>(alpha)})
            .first;
    before = now;
    outcome.residual = std::sqrt(square / start);
    ++outcome.iterations;
  }
  return outcome;
}

}  // namespace emberlock::recon
