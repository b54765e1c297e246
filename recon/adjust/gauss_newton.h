// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "recon/adjust/descent.h"

namespace emberlock::recon {

/// The parabola that the default solver's objective (descent.h) looks like near a volume x: the Hessian
///   H = J^T J + T
/// J: what the fitted rays show, by x (emission R, G, B and, where it is a field, extinction; a voxel edge),
/// without bounds that are met; T: the ties between neighbours as they are at x. Lanes that are 0 or at their
/// bound are held: H and J leave them out.
class GaussNewton {
 public:
  using Points = std::vector<Rgba>;  ///< one a key point of the level's grid, or one a ray

  /// The level and what the setup refers to must outlive it.
  GaussNewton(const Level& level, const SolverSetup& setup, Points x);

  /// J^T v.
  [[nodiscard]] Points transpose(const Points& rays);
  /// D^T n of noise n of this size in each tie, T = D^T D: adds size^2 T to a right side's covariance.
  [[nodiscard]] Points tie_noise(double size, std::uint64_t seed, std::uint64_t probe) const;
  /// H d. Where extinction is a field J d is the difference of two marches.
  [[nodiscard]] Points apply(const Points& d);
  struct Solved {
    Points x;
    int steps = 0;
  };
  /// H^-1 b by preconditioned conjugate gradients (Hestenes and Stiefel 1952), until the residual's norm is
  /// so small a share of b's, or for so many steps.
  [[nodiscard]] Solved solve(const Points& b, double residual, int most_steps);

  [[nodiscard]] bool moves(std::size_t point, int lane) const { return free_[point].c[lane] > 0; }

 private:
  static Descent begun(const Level& level, const SolverSetup& setup, const Points& x);
  void hold_and_precondition();
  [[nodiscard]] Points along(const Points& d);
  [[nodiscard]] Points shown(const Points& x, Engine::Behind behind);
  void leave_out_bounds(Points& rays) const;
  [[nodiscard]] Points divided(const Points& r) const;
  [[nodiscard]] double dot(const Points& a, const Points& b) const;
  [[nodiscard]] Rgba tied(const Points& d, int i, int j, int k) const;
  template <class Act>
  void each_neighbour(int i, int j, int k, const Act& act) const;
  template <class Act>
  void each_point(const Act& act) const;
  template <class Act>
  void each_of(std::size_t count, const Act& act) const;

  const Level& level_;
  Pool& pool_;
  Points x_;
  Descent descent_;
  Engine& engine_ = descent_.engine();
  Points shown_;                  // by x, the background included
  Points counts_;                 // rays: 0 where a bound is met; empty: all of them count
  Points free_;                   // 1 or 0
  Points diagonal_;               // that of the solver's majoriser
  std::vector<float> weights_;    // of the solver's steps
  std::vector<float> stiffness_;  // see Stiffen
  std::vector<float> beyond_;     // extinction, beyond what is expected
};

}  // namespace emberlock::recon
