// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"

#include <cmath>
#include <limits>

#include "paper/baselines/linear_projector.h"

namespace emberlock::paper {
namespace {

/// Conjugate gradients for the least squares of A x = b (Hestenes and Stiefel 1952; Bjorck 1996, CGLS), of
/// three channels that share A and nothing else. Begins with x = 0.
class ConjugateGradients {
 public:
  explicit ConjugateGradients(const LinearProjector& a) : a_(a), x_(a.grid().size()), residual_(a.seen()) {
    a_.back_project(residual_, gradient_);
    direction_ = gradient_;
    slope_ = dot(gradient_, gradient_, a_.pool());
  }

  void step() {
    recon::Pool& pool = a_.pool();
    a_.project(direction_, projected_);
    const Channels curvature = dot(projected_, projected_, pool);
    Channels length = {};
    Channels back = {};
    for (std::size_t c = 0; c < 3; ++c) {
      length[c] = curvature[c] > 0 ? slope_[c] / curvature[c] : 0;
      back[c] = -length[c];
    }
    combine(x_, length, direction_, x_, pool);
    combine(residual_, back, projected_, residual_, pool);
    a_.back_project(residual_, gradient_);
    const Channels next = dot(gradient_, gradient_, pool);
    Channels conjugate = {};
    for (std::size_t c = 0; c < 3; ++c) conjugate[c] = slope_[c] > 0 ? next[c] / slope_[c] : 0;
    combine(gradient_, conjugate, direction_, direction_, pool);
    slope_ = next;
  }

  [[nodiscard]] const Light& x() const { return x_; }
  [[nodiscard]] Channels slope() const { return slope_; }
  [[nodiscard]] Channels squares() const { return dot(residual_, residual_, a_.pool()); }

 private:
  const LinearProjector& a_;
  Light x_, residual_, gradient_, direction_, projected_;
  Channels slope_ = {};
};

constexpr int kMostIterations = 300;

/// Where the equations of all channels hold so well: |A^T (A x - b)| over |A^T b|.
constexpr double kConverged = 1e-4;

/// The x with the least |A x - b| |x|, once it hasn't been lower for a while.
Light at_the_corner(const LinearProjector& projector, const MethodOptions& options, int& iterations) {
  constexpr int kPatience = 10;
  ConjugateGradients search(projector);
  Light best = search.x();
  double least = std::numeric_limits<double>::infinity();
  for (int n = 1; n <= kMostIterations && n <= iterations + kPatience; ++n) {
    search.step();
    const double product = std::sqrt(sum_of(search.squares())) *
                           std::sqrt(sum_of(dot(search.x(), search.x(), projector.pool())));
    if (product < least) {
      least = product;
      best = search.x();
      iterations = n;
    }
    if (options.stop && options.stop()) break;
  }
  return best;
}

Light at_convergence(const LinearProjector& projector, const MethodOptions& options, int& iterations) {
  ConjugateGradients search(projector);
  const double enough = kConverged * kConverged * sum_of(search.slope());
  do {
    search.step();
    ++iterations;
  } while (iterations < kMostIterations && sum_of(search.slope()) > enough &&
           !(options.stop && options.stop()));
  return search.x();
}

template <class Solve>
Result<MethodResult> solve_equations(const recon::Scene& scene, const MethodOptions& options,
                                     const Solve& solve) {
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 1));
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  const LinearProjector projector(input.views, input.hull, 1, pool);
  int iterations = 0;
  const Light x = solve(projector, options, iterations);
  return conclude(input, projector, x, iterations);
}

}  // namespace

Result<MethodResult> algebraic_tomography(const recon::Scene& scene, const MethodOptions& options) {
  return solve_equations(scene, options, at_the_corner);
}

Result<MethodResult> converged_algebraic_tomography(const recon::Scene& scene, const MethodOptions& options) {
  return solve_equations(scene, options, at_convergence);
}

}  // namespace emberlock::paper
