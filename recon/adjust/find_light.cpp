// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/find_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <vector>

#include <Eigen/Geometry>

#include "recon/adjust/lit_descent.h"

namespace emberlock::recon {
namespace {

constexpr int kVoxels = 32;            // along the longest side, at most
constexpr std::size_t kPixels = 8000;  // of the flames' boxes are looked at
constexpr int kFinerVoxels = 64;
constexpr std::size_t kFinerPixels = 15000;
constexpr int kDirections = 32;
constexpr std::array<double, 3> kDepths = {0.25, 0.6, 1.4};  // of the mean ray
constexpr int kQuickPasses = 12;
constexpr int kPasses = 24;

struct Tried {
  Light light;
  double depth = 0;
  double error = std::numeric_limits<double>::infinity();
};

using Late = std::function<bool()>;

bool fits_better(const Tried& a, const Tried& b) { return a.error < b.error; }

Eigen::Vector3d vector(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }
std::array<double, 3> array(const Eigen::Vector3d& v) { return {v[0], v[1], v[2]}; }

/// Evenly over the sphere: Fibonacci's spiral.
Eigen::Vector3d direction(int n) {
  const double z = 1 - (2 * n + 1.0) / kDirections;
  const double turn = n * std::numbers::pi * (3 - std::sqrt(5.0));
  const double r = std::sqrt(1 - z * z);
  return {r * std::cos(turn), r * std::sin(turn), z};
}

/// Two axes across a direction.
std::array<Eigen::Vector3d, 2> across(const Eigen::Vector3d& d) {
  const Eigen::Vector3d first = d.unitOrthogonal();
  return {first, d.cross(first).normalized()};
}

Light lit(Light::Source source, const Eigen::Vector3d& place) {
  Light light;
  light.source = source;
  light.place = array(place);
  return light;
}

/// What a search looks at: the pixels of one grid, under a light that isn't known yet.
struct LitProblem {
  SolverSetup setup;
  Hull hull;
  Level level;
  double chord = 0;  ///< mean length of a ray inside the hull, metres

  LitProblem(const SolverSetup& of, int voxels, std::size_t pixels)
      : setup(of), hull(coarsen_to(of.hull, voxels)) {
    setup.effects.light.source = Light::Source::even;  // a level that LitDescent takes
    setup.effects.extinction = {};
    level = make_level(setup, hull, stride_for_rays(setup, pixels), 4);
    const double rays = std::max(1.0, static_cast<double>(level.problem.rays()));
    chord = total_length(level.problem.list, setup.pool) / rays * static_cast<double>(hull.grid.edge);
  }
  [[nodiscard]] std::unique_ptr<LitDescent> begin(const Light& light, double depth) const {
    SolverSetup under = setup;
    under.effects.light = light;
    const LitStart glow(level, under, {Extinction::Model::field, PerMeter(0), PerMeter(depth / chord)});
    return std::make_unique<LitDescent>(level, under, glow.start());
  }
  [[nodiscard]] Tried attempt(const Light& light, double depth, int passes) const try {
    const std::unique_ptr<LitDescent> descent = begin(light, depth);
    descend(*descent, passes);
    const double error = descent->judge();
    return {descent->light(), depth, std::isfinite(error) ? error : std::numeric_limits<double>::infinity()};
  } catch (const Diverged&) {
    return {light, depth};
  }
};

/// Moves a light to where it fits better, by cold solves of one problem, all with the same density to begin
/// with.
class Refinement {
 public:
  explicit Refinement(const LitProblem& problem) : problem_(problem) {
    const Grid& g = problem.level.problem.grid();
    const Eigen::Vector3d size = static_cast<double>(g.edge) * Eigen::Vector3d(g.nx - 1, g.ny - 1, g.nz - 1);
    middle_ = Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>() + size / 2;
    radius_ = size.norm() / 2;
  }

  /// Sideways and, of one nearby, nearer and farther: to the vertices of parabolas through what is left on
  /// both sides, in smaller and smaller steps.
  [[nodiscard]] Tried refined(Tried best, const Late& late) const {
    for (const double step : {0.25, 0.25, 0.12, 0.12})
      if (!late()) best = moved_on(best, step, late);
    return best;
  }
  /// The same light nearby, at the best of some distances; of infinite error where there is none.
  [[nodiscard]] Tried brought_near(const Tried& distant, const Late& late) const {
    const Eigen::Vector3d towards = vector(distant.light.place).normalized();
    Tried best;
    for (const double far : {1.4, 2.4}) {
      if (late()) break;
      const Light light = lit(Light::Source::nearby, middle_ + far * radius_ * towards);
      best = std::min(best, problem_.attempt(light, distant.depth, kPasses), fits_better);
    }
    return best;
  }
  /// So far away that it can't be told from a distant one.
  [[nodiscard]] bool is_far(const Light& nearby) const {
    constexpr double kFar = 4;
    return (vector(nearby.place) - middle_).norm() > kFar * radius_;
  }

 private:
  [[nodiscard]] Light moved(const Light& light, const Eigen::Vector3d& by) const {
    if (light.source == Light::Source::distant)
      return lit(light.source, (vector(light.place) + by).normalized());
    const Eigen::Vector3d from = vector(light.place) - middle_;
    const Eigen::Vector3d to = from + from.norm() * by;
    return lit(light.source, middle_ + std::max(1.0, 1.05 * radius_ / to.norm()) * to);  // not inside
  }
  [[nodiscard]] Tried moved_on(const Tried& from, double step, const Late& late) const {
    constexpr double kMostSteps = 1.5;
    const bool is_near = from.light.source == Light::Source::nearby;
    const Eigen::Vector3d out =
        (is_near ? Eigen::Vector3d(vector(from.light.place) - middle_) : vector(from.light.place))
            .normalized();
    const auto sides = across(out);
    std::vector<Eigen::Vector3d> ways = {sides[0], sides[1]};
    if (is_near) ways.push_back(out);
    Tried best = from;
    Eigen::Vector3d by = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& way : ways) {
      if (late()) return best;
      const Tried ahead = problem_.attempt(moved(from.light, step * way), from.depth, kPasses);
      const Tried back = problem_.attempt(moved(from.light, -step * way), from.depth, kPasses);
      best = std::min({best, ahead, back}, fits_better);
      const double slope = (ahead.error - back.error) / 2;
      const double curvature = ahead.error + back.error - 2 * from.error;
      if (!std::isfinite(slope) || !std::isfinite(curvature)) continue;
      by += step * way *
            (curvature > 0 ? std::clamp(-slope / curvature, -kMostSteps, kMostSteps)
                           : (slope > 0 ? -1.0 : 1.0));
    }
    return std::min(best, problem_.attempt(moved(from.light, by), from.depth, kPasses), fits_better);
  }

  const LitProblem& problem_;
  Eigen::Vector3d middle_;
  double radius_ = 0;  // of the box around the medium, metres
};

Tried best_depth(const LitProblem& problem, const Light& light, const Late& late) {
  Tried best{light};
  for (const double depth : kDepths) {
    if (std::isfinite(best.error) && late()) break;
    best = std::min(best, problem.attempt(light, depth, kPasses), fits_better);
  }
  return best;
}

FoundLight result(const LitProblem& problem, const Tried& tried, double even_error) {
  FoundLight found{tried.light, PerMeter(tried.depth / problem.chord), tried.error, std::nullopt};
  if (std::isfinite(even_error)) found.even_error = even_error;
  return found;
}

class Search {
 public:
  Search(const SolverSetup& setup, const Late& late) : late_(late), coarse_(setup, kVoxels, kPixels) {}

  [[nodiscard]] FoundLight operator()() const {
    const Tried even = best_depth(coarse_, lit(Light::Source::even, {}), late_);
    const Tried rough = best_direction();
    const bool is_even = !(rough.error < (1 - kLeastLessError) * even.error);
    return result(coarse_, is_even ? even : rough, even.error);
  }

 private:
  [[nodiscard]] Tried best_direction() const {
    std::vector<Tried> all;
    for (int n = 0; n < kDirections; ++n) {
      if (n > 0 && late_()) break;
      all.push_back(coarse_.attempt(lit(Light::Source::distant, direction(n)), kDepths[1], kQuickPasses));
    }
    constexpr std::size_t kCloser = 2;
    std::sort(all.begin(), all.end(), fits_better);
    Tried best;
    for (std::size_t n = 0; n < std::min(kCloser, all.size()); ++n)
      best = std::min(best, best_depth(coarse_, all[n].light, late_), fits_better);
    return best;
  }

  const Late& late_;
  LitProblem coarse_;
};

Late late_by(const SolverSetup& setup, const Elapsed& elapsed) {
  return [&] { return is_spent(0.4, setup.options, elapsed); };
}

}  // namespace

FoundLight find_light(const SolverSetup& setup, const Light& asked, const Elapsed& elapsed) {
  const Late late = late_by(setup, elapsed);
  if (asked.source == Light::Source::found) return Search(setup, late)();
  const LitProblem fine(setup, kFinerVoxels, kFinerPixels);
  return result(fine, best_depth(fine, asked, late), std::numeric_limits<double>::infinity());
}

FoundLight refine_light(const SolverSetup& setup, const FoundLight& rough, const Elapsed& elapsed) {
  const Late late = late_by(setup, elapsed);
  if (rough.light.source != Light::Source::distant || late()) return rough;
  const LitProblem fine(setup, kFinerVoxels, kFinerPixels);
  const Refinement around(fine);
  const Tried first = best_depth(fine, rough.light, late);
  if (!std::isfinite(first.error)) return rough;
  const Tried distant = around.refined(first, late);
  Tried nearby = around.brought_near(distant, late);
  if (std::isfinite(nearby.error)) nearby = around.refined(nearby, late);
  const bool is_near = nearby.error < (1 - kLeastLessError) * distant.error && !around.is_far(nearby.light);
  const Tried& best = is_near ? nearby : distant;
  double even_error = std::numeric_limits<double>::infinity();
  if (!late()) even_error = fine.attempt(lit(Light::Source::even, {}), best.depth, kPasses).error;
  return result(fine, best, even_error);
}

}  // namespace emberlock::recon
