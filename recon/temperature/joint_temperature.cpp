// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/joint_temperature.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "recon/adjust/descent.h"
#include "recon/adjust/guard.h"
#include "recon/adjust/prepared_scene.h"
#include "recon/temperature/glow_cost.h"

namespace emberlock::recon {
namespace {

constexpr int kIterations = 16;
constexpr int kSubsets = 16;              // whose samples are held one at a time
constexpr double kDropThatCounts = 1e-4;  // of the cost: less ends it
constexpr GlowTies kTies{0.1, 0.1};
constexpr double kMostMomentum = 0.95;

/// What a problem's key points show, and where they lie in the whole grid.
struct Begin {
  GlowStart start;
  GlowField<float> at;
  std::vector<std::size_t> place;
};

Begin begin_at(const Problem& problem, const Optics& optics, const Reconstruction& done,
               const std::vector<float>& kelvin) {
  const Grid& part = problem.grid();
  Begin begin{{to_solution(done.volume, problem, done.effects), std::vector<float>(part.size()),
               optics.absorb, static_cast<double>(optics.sigma), optics.white},
              {std::vector<float>(part.size()), std::vector<float>(part.size())},
              std::vector<std::size_t>(part.size())};
  const int* offset = problem.crop.offset;
  for (int k = 0; k < part.nz; ++k)
    for (int j = 0; j < part.ny; ++j)
      for (int i = 0; i < part.nx; ++i) {
        const std::size_t p = part.index(i, j, k);
        const std::size_t w = done.volume.grid.index(i + offset[0], j + offset[1], k + offset[2]);
        const Rgba& light = begin.start.light[p];
        if (kelvin[w] > 0) begin.start.total[p] = light.c[0] + light.c[1] + light.c[2];
        begin.at.kelvin[p] = kelvin[w];
        begin.place[p] = w;
      }
  return begin;
}

/// Nesterov's accelerated descent; where the cost rises it goes back to the best, without momentum, and where
/// that was a plain step already, the next ones are half as long (O'Donoghue and Candes 2015).
JointSolve descend(GlowCost<float>& cost, GlowField<float>& at, const SolveOptions& options) {
  JointSolve out;
  GlowField<float> best = at;
  GlowField<float> stepped = at;  // without momentum
  GlowField<float> best_slope;
  GlowField<float> slope;
  double length = 1;
  double time = 1;
  bool plain = true;  // whether `at` is the best's own step, without momentum
  for (int n = 0; n <= kIterations && (n == 0 || !is_stopped(options)); ++n) {
    const double now = cost(at, slope);
    if (n == 0) {
      if (!std::isfinite(now)) throw Diverged(now, now);
      out.before = now;
    }
    out.iterations = n;
    if (n == 0 || now < out.after) {
      if (n > 0) out.last_drop = 1 - now / out.after;
      out.after = now;
      best = at;
      best_slope = slope;
      if (n == kIterations || (n > 1 && out.last_drop < kDropThatCounts)) break;
      const double next = (1 + std::sqrt(1 + 4 * time * time)) / 2;
      const auto momentum = static_cast<float>(std::min(kMostMomentum, (time - 1) / next));
      time = next;
      plain = !(momentum > 0);
      GlowField<float> before = std::exchange(stepped, at);
      cost.descend(stepped, slope, length);
      at = stepped;
      for (std::size_t p = 0; p < at.kelvin.size(); ++p) {
        at.kelvin[p] += momentum * (stepped.kelvin[p] - before.kelvin[p]);
        at.brightness[p] += momentum * (stepped.brightness[p] - before.brightness[p]);
      }
    } else {
      if (plain) length /= 2;
      plain = true;
      time = 1;
      at = best;
      cost.descend(at, best_slope, length);
      stepped = at;
    }
  }
  at = std::move(best);
  return out;
}

}  // namespace

bool can_solve_together(const Effects& effects) {
  return effects.scattering.order == Scattering::Order::none &&
         effects.refraction.rays == Refraction::Rays::straight &&
         effects.exposure.shutter != Exposure::Shutter::integrated;
}

JointSolve solve_together(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                          const SolveOptions& options, const Elapsed& elapsed, std::vector<float>& kelvin) {
  const Seconds began = elapsed ? elapsed() : Seconds(0);
  const auto prepared = PreparedScene::create(scene, done.effects);
  if (!prepared.ok()) throw std::logic_error(prepared.error().message());
  Pool pool(options.compute.threads);
  SolverSetup setup{{}, {}, done.hull, done.effects, options, pool};
  for (const View& view : prepared->scene().views)
    if (view.role == ViewRole::input) setup.views.push_back(&view);
  ProblemOptions rays = setup.problem_options();
  rays.rule.stride = stride_for(setup, done.volume.grid);
  rays.subsets = rays.rule.dealt = kSubsets;
  const Problem problem = make_problem(setup.views, done.hull, rays, pool);
  Begin begin = begin_at(problem, setup.optics(done.volume.grid), done, kelvin);
  const std::vector<float> total = begin.start.total;
  GlowCost<float> cost(problem, std::move(begin.start), EmitterColours(table), pool);
  cost.weigh(begin.at, kTies);
  JointSolve out = descend(cost, begin.at, options);
  double weights = 0;
  for (std::size_t p = 0; p < total.size(); ++p) {
    if (!(total[p] > 0)) continue;
    float& here = kelvin[begin.place[p]];
    const auto moved = static_cast<double>(begin.at.kelvin[p] - here);
    here = begin.at.kelvin[p];
    out.moved += static_cast<double>(total[p]) * moved * moved;
    weights += static_cast<double>(total[p]);
  }
  if (weights > 0) out.moved = std::sqrt(out.moved / weights);
  if (elapsed) out.time = elapsed() - began;
  return out;
}

}  // namespace emberlock::recon
