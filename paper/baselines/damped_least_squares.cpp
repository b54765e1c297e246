// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/damped_least_squares.h"

#include <cstddef>

namespace emberlock::paper {
namespace {

/// damping times the mean of A^T A 1.
Channels damping_of(const LinearMap& map, double damping) {
  const Light ones(map.unknowns(), recon::Rgba{{1, 1, 1, 0}});
  Light seen;
  Light weights;
  map.project(ones, seen);
  map.back_project(seen, weights);
  double met = 0;
  for (const recon::Rgba& weight : weights) met += weight.c[0] > 0 ? 1 : 0;
  const double mean = met > 0 ? dot(weights, ones, map.pool())[0] / met : 1;
  return {damping * mean, damping * mean, damping * mean};
}

/// a / b by channel; 0 where b is.
Channels over(const Channels& a, const Channels& b) {
  Channels ratio = {};
  for (std::size_t c = 0; c < 3; ++c) ratio[c] = b[c] > 0 ? a[c] / b[c] : 0;
  return ratio;
}

Channels negative(const Channels& a) { return {-a[0], -a[1], -a[2]}; }

}  // namespace

DampedSolution damped_least_squares(const LinearMap& map, double damping, const std::function<bool()>& stop) {
  constexpr int kMostIterations = 200;
  constexpr double kConverged = 1e-3;
  recon::Pool& pool = map.pool();
  const Channels weight = damping_of(map, damping);
  DampedSolution solution{Light(map.unknowns()), 0};
  Light residual = map.seen();
  Light gradient;
  Light projected;
  map.back_project(residual, gradient);
  Light direction = gradient;
  Channels slope = dot(gradient, gradient, pool);
  const double enough = kConverged * kConverged * sum_of(slope);
  while (solution.iterations < kMostIterations && sum_of(slope) > enough && !(stop && stop())) {
    map.project(direction, projected);
    Channels curvature = dot(projected, projected, pool);
    const Channels length2 = dot(direction, direction, pool);
    for (std::size_t c = 0; c < 3; ++c) curvature[c] += weight[c] * length2[c];
    const Channels length = over(slope, curvature);
    combine(solution.x, length, direction, solution.x, pool);
    combine(residual, negative(length), projected, residual, pool);
    map.back_project(residual, gradient);
    combine(gradient, negative(weight), solution.x, gradient, pool);
    const Channels next = dot(gradient, gradient, pool);
    combine(gradient, over(next, slope), direction, direction, pool);
    slope = next;
    ++solution.iterations;
  }
  return solution;
}

void clip_negative(Light& x, recon::Pool& pool) {
  each_of(x.size(), pool, [&](std::size_t i) { x[i] = recon::non_negative(x[i]); });
}

}  // namespace emberlock::paper
