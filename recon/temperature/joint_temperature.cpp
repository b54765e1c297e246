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

/// The rays of a scene's input views, and what they cost.
class JointProblem {
 public:
  JointProblem(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
               const SolveOptions& options, const GlowField<float>& from)
      : scene_(prepared(scene, done)),
        pool_(options.compute.threads),
        problem_(problem_of(done, options)),
        place_(place_in(done.volume.grid)),
        cost_(problem_, start_at(done, options, from), EmitterColours(table), pool_) {}

  [[nodiscard]] GlowCost<float>& cost() { return cost_; }
  [[nodiscard]] const std::vector<float>& total() const { return total_; }
  /// Of the reconstruction's key points those of the problem.
  [[nodiscard]] GlowField<float> of_whole(const GlowField<float>& whole) const {
    GlowField<float> part{std::vector<float>(place_.size()), std::vector<float>(place_.size())};
    for (std::size_t p = 0; p < place_.size(); ++p) {
      part.brightness[p] = whole.brightness[place_[p]];
      part.kelvin[p] = whole.kelvin[place_[p]];
    }
    return part;
  }
  /// Where it moves.
  void put(const GlowField<float>& part, GlowField<float>& whole) const {
    for (std::size_t p = 0; p < place_.size(); ++p) {
      if (!(total_[p] > 0)) continue;
      whole.brightness[place_[p]] = part.brightness[p];
      whole.kelvin[place_[p]] = part.kelvin[p];
    }
  }

 private:
  static PreparedScene prepared(const Scene& scene, const Reconstruction& done) {
    auto made = PreparedScene::create(scene, done.effects);
    if (!made.ok()) throw std::logic_error(made.error().message());
    return *std::move(made);
  }
  [[nodiscard]] SolverSetup setup(const Reconstruction& done, const SolveOptions& options) {
    SolverSetup setup{{}, {}, done.hull, done.effects, options, pool_};
    for (const View& view : scene_.scene().views)
      if (view.role == ViewRole::input) setup.views.push_back(&view);
    return setup;
  }
  Problem problem_of(const Reconstruction& done, const SolveOptions& options) {
    const SolverSetup own = setup(done, options);
    ProblemOptions rays = own.problem_options();
    rays.rule.stride = stride_for(own, done.volume.grid);
    rays.subsets = rays.rule.dealt = kSubsets;
    return make_problem(own.views, done.hull, rays, pool_);
  }
  [[nodiscard]] std::vector<std::size_t> place_in(const Grid& whole) const {
    const Grid& part = problem_.grid();
    const int* offset = problem_.crop.offset;
    std::vector<std::size_t> place;
    place.reserve(part.size());
    for (int k = 0; k < part.nz; ++k)
      for (int j = 0; j < part.ny; ++j)
        for (int i = 0; i < part.nx; ++i)
          place.push_back(whole.index(i + offset[0], j + offset[1], k + offset[2]));
    return place;
  }
  GlowStart start_at(const Reconstruction& done, const SolveOptions& options, const GlowField<float>& from) {
    const Optics optics = setup(done, options).optics(done.volume.grid);
    GlowStart start{to_solution(done.volume, problem_, done.effects), std::vector<float>(place_.size()),
                    optics.absorb, static_cast<double>(optics.sigma), optics.white};
    for (std::size_t p = 0; p < place_.size(); ++p) {
      const Rgba& light = start.light[p];
      if (from.kelvin[place_[p]] > 0) start.total[p] = light.c[0] + light.c[1] + light.c[2];
    }
    total_ = start.total;
    return start;
  }

  PreparedScene scene_;
  Pool pool_;
  Problem problem_;
  std::vector<std::size_t> place_;  // of its key points in the whole grid
  std::vector<float> total_;        // the light that moves, levels a voxel edge
  GlowCost<float> cost_;
};

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
                          const SolveOptions& options, const Elapsed& elapsed, GlowField<float>& glow) {
  const Seconds began = elapsed ? elapsed() : Seconds(0);
  JointProblem problem(scene, done, table, options, glow);
  const GlowField<float> before = problem.of_whole(glow);
  GlowField<float> at = before;
  problem.cost().weigh(at, kTies);
  JointSolve out = descend(problem.cost(), at, options);
  problem.put(at, glow);
  double weights = 0;
  for (std::size_t p = 0; p < problem.total().size(); ++p) {
    const auto weight = static_cast<double>(problem.total()[p]);
    if (!(weight > 0)) continue;
    out.moved += weight * std::pow(static_cast<double>(at.kelvin[p] - before.kelvin[p]), 2);
    weights += weight;
  }
  if (weights > 0) out.moved = std::sqrt(out.moved / weights);
  if (elapsed) out.time = elapsed() - began;
  return out;
}

Misfits misfits(const Scene& scene, const Reconstruction& done, const EmitterTable& table,
                const SolveOptions& options, const GlowField<float>& first, const GlowField<float>& second) {
  JointProblem problem(scene, done, table, options, first);
  const GlowField<float> at = problem.of_whole(first);
  problem.cost().weigh(at, {});
  GlowField<float> slope;
  const double cost = problem.cost()(at, slope);
  return {2 * cost, 2 * problem.cost()(problem.of_whole(second), slope)};
}

}  // namespace emberlock::recon
