// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/penalised_least_squares.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace emberlock::paper {
namespace {

/// A^T A 1.
Light curvature(const LinearMap& map) {
  Light lengths;
  Light result;
  map.project(Light(map.unknowns(), recon::Rgba{{1, 1, 1, 0}}), lengths);
  map.back_project(lengths, result);
  return result;
}

/// The same, no less than a share of its mean where few rays come.
std::vector<float> step_weights(const LinearMap& map) {
  constexpr float kLeastShare = 0.02F;
  const Light weights = curvature(map);
  double sum = 0;
  std::size_t lit = 0;
  for (const recon::Rgba& w : weights) {
    sum += static_cast<double>(w.c[0]);
    lit += w.c[0] > 0 ? 1 : 0;
  }
  const float least =
      kLeastShare * static_cast<float>(sum / static_cast<double>(std::max<std::size_t>(1, lit)));
  std::vector<float> result(weights.size());
  for (std::size_t p = 0; p < weights.size(); ++p) result[p] = std::max(least, weights[p].c[0]);
  return result;
}

/// Of the moves x -> next: whether it goes against what led to it from the look-ahead, and its length.
struct Move {
  double uphill = 0;
  double moved = 0;
  double norm = 0;
};
Move move_of(const Light& ahead, const Light& x, const Light& next, const std::vector<float>& weights,
             recon::Pool& pool) {
  constexpr int kParts = 64;
  std::vector<Move> parts(kParts);
  pool.run(kParts, [&](int task) {
    Move& part = parts[static_cast<std::size_t>(task)];
    const recon::Slice mine = recon::slice(x.size(), kParts, task);
    for (std::size_t p = mine.begin; p < mine.end; ++p)
      for (int c = 0; c < 3; ++c) {
        const auto step = static_cast<double>(next[p].c[c] - x[p].c[c]);
        part.uphill +=
            static_cast<double>(weights[p]) * static_cast<double>(ahead[p].c[c] - next[p].c[c]) * step;
        part.moved += step * step;
        part.norm += static_cast<double>(next[p].c[c]) * static_cast<double>(next[p].c[c]);
      }
  });
  Move all;
  for (const Move& part : parts) {
    all.uphill += part.uphill;
    all.moved += part.moved;
    all.norm += part.norm;
  }
  return all;
}

}  // namespace

Lattice lattice_of(const LinearProjector& projector) {
  Lattice lattice{projector.grid(), std::vector<std::uint8_t>(projector.unknowns())};
  for (std::size_t p = 0; p < lattice.active.size(); ++p) lattice.active[p] = projector.takes_part(p) ? 1 : 0;
  return lattice;
}

double mean_curvature(const LinearMap& map, const Lattice& lattice) {
  const Light of = curvature(map);
  double sum = 0;
  double points = 0;
  for (std::size_t p = 0; p < of.size(); ++p) {
    if (lattice.active[p] == 0) continue;
    sum += static_cast<double>(of[p].c[0]);
    points += 1;
  }
  return sum / std::max(1.0, points);
}

Fit minimise(const LinearMap& map, Penalty& penalty, int most, double least_change,
             const std::function<bool()>& stop) {
  recon::Pool& pool = map.pool();
  std::vector<float> weights = step_weights(map);
  penalty.add_curvature(weights);
  Fit fit{Light(map.unknowns()), 0};
  Light ahead = fit.x;
  Light residual;
  Light next;
  double time = 1;
  do {
    map.project(ahead, residual);
    combine(residual, {-1, -1, -1}, map.seen(), residual, pool);
    map.back_project(residual, next);
    penalty.add_gradient(ahead, next);
    each_of(next.size(), pool, [&](std::size_t p) { next[p] = ahead[p] - (1 / weights[p]) * next[p]; });
    penalty.approach(weights, next);
    ++fit.iterations;
    const Move move = move_of(ahead, fit.x, next, weights, pool);
    if (move.uphill > 0) time = 1;
    const double later = 0.5 * (1 + std::sqrt(1 + 4 * time * time));
    const auto momentum = static_cast<float>((time - 1) / later);
    time = later;
    each_of(next.size(), pool, [&](std::size_t p) { ahead[p] = next[p] + momentum * (next[p] - fit.x[p]); });
    std::swap(fit.x, next);
    if (move.moved <= least_change * least_change * move.norm) break;
  } while (fit.iterations < most && !(stop && stop()));
  return fit;
}

}  // namespace emberlock::paper
