// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/find_light.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>

#include "recon/adjust/lit_descent.h"

namespace emberlock::recon {
namespace {

constexpr int kVoxels = 32;            // along the longest side, at most
constexpr std::size_t kPixels = 8000;  // of the flames' boxes are looked at
constexpr int kDirections = 32;
constexpr std::array<double, 3> kDepths = {0.25, 0.6, 1.4};  // of the mean ray
constexpr int kQuickPasses = 12;
constexpr int kPasses = 24;

struct Tried {
  Light light;
  double depth = 0;
  double error = std::numeric_limits<double>::infinity();
};

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

class Search {
 public:
  Search(const SolverSetup& setup, const Elapsed& elapsed)
      : setup_(under_a_light(setup)),
        elapsed_(elapsed),
        hull_(coarsen_to(setup.hull, kVoxels)),
        level_(make_level(setup_, hull_, stride_for_rays(setup, kPixels), 4)) {
    const Grid& g = level_.problem.grid();
    const Eigen::Vector3d size = static_cast<double>(g.edge) * Eigen::Vector3d(g.nx - 1, g.ny - 1, g.nz - 1);
    middle_ = Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>() + size / 2;
    radius_ = size.norm() / 2;
    const double rays = std::max(1.0, static_cast<double>(level_.problem.rays()));
    chord_ = total_length(level_.problem.list, setup.pool) / rays * static_cast<double>(g.edge);
  }

  FoundLight operator()(const Light& asked) {
    using Source = Light::Source;
    if (asked.source != Source::found) return result(best_depth(asked, kPasses));
    const Tried even = best_depth(lit(Source::even, {}), kPasses);
    Tried distant = best_direction();
    distant = refined(distant);
    FoundLight found = result(even);
    if (distant.error < (1 - kLeastLessError) * even.error) {
      const Tried nearby = best_nearby(distant);
      const bool is_near = nearby.error < (1 - kLeastLessError) * distant.error;
      found = result(is_near ? nearby : distant);
      found.other_error = is_near ? distant.error : nearby.error;
    }
    found.even_error = even.error;
    return found;
  }

 private:
  static SolverSetup under_a_light(const SolverSetup& setup) {
    SolverSetup lit = setup;
    lit.effects.light.source = Light::Source::even;  // a level that LitDescent takes
    lit.effects.extinction = {};
    return lit;
  }

  [[nodiscard]] Tried attempt(const Light& light, double depth, int passes) const try {
    SolverSetup setup = setup_;
    setup.effects.light = light;
    const LitStart glow(level_, setup,
                        {Extinction::Model::field, PerMeter(0), PerMeter(depth / chord_)});
    LitDescent descent(level_, setup, glow.start());
    descend(descent, passes);
    const double error = descent.judge();
    return {descent.light(), depth, std::isfinite(error) ? error : std::numeric_limits<double>::infinity()};
  } catch (const Diverged&) {
    return {light, depth};
  }

  [[nodiscard]] Tried best_depth(const Light& light, int passes) const {
    Tried best{light};
    for (const double depth : kDepths) best = std::min(best, attempt(light, depth, passes), fits_better);
    return best;
  }

  [[nodiscard]] Tried best_direction() const {
    std::vector<Tried> all;
    for (int n = 0; n < kDirections; ++n) {
      if (n > 0 && late()) break;
      all.push_back(attempt(lit(Light::Source::distant, direction(n)), kDepths[1], kQuickPasses));
    }
    constexpr std::size_t kCloser = 4;
    std::sort(all.begin(), all.end(), fits_better);
    Tried best;
    for (std::size_t n = 0; n < std::min(kCloser, all.size()); ++n)
      best = std::min(best, best_depth(all[n].light, kPasses), fits_better);
    return best;
  }

  /// Compass search over the directions, in steps from half of what the spiral's points are apart.
  [[nodiscard]] Tried refined(Tried best) const {
    for (double step = 0.25; step > 0.02; step /= 2) {
      bool moved = true;
      for (int round = 0; moved && round < 4 && !late(); ++round) {
        moved = false;
        const Eigen::Vector3d from = vector(best.light.place);
        for (const Eigen::Vector3d& axis : across(from))
          for (const double way : {step, -step}) {
            Light light = best.light;
            light.place = array((from + way * axis).normalized());
            const Tried next = attempt(light, best.depth, kPasses);
            if (!fits_better(next, best)) continue;
            best = next;
            moved = true;
          }
      }
    }
    return best;
  }

  /// Along the distant light's direction, then around the best place: sideways, and nearer and farther.
  [[nodiscard]] Tried best_nearby(const Tried& distant) const {
    const Eigen::Vector3d towards = vector(distant.light.place);
    Tried best;
    for (const double far : {1.3, 2.0, 3.5}) {
      if (late()) break;
      best = std::min(best,
                      attempt(lit(Light::Source::nearby, middle_ + far * radius_ * towards), distant.depth,
                              kPasses),
                      fits_better);
    }
    for (double step = 0.25; step > 0.03 && !late(); step /= 2) {
      bool moved = true;
      for (int round = 0; moved && round < 4 && !late(); ++round) {
        moved = false;
        const Eigen::Vector3d from = vector(best.light.place) - middle_;
        const auto sides = across(from.normalized());
        for (const Eigen::Vector3d& axis : {from.normalized(), sides[0], sides[1]})
          for (const double way : {step, -step}) {
            const Eigen::Vector3d to = from + way * from.norm() * axis;
            if (to.norm() < radius_) continue;  // no light inside
            const Tried next = attempt(lit(Light::Source::nearby, middle_ + to), best.depth, kPasses);
            if (!fits_better(next, best)) continue;
            best = next;
            moved = true;
          }
      }
    }
    return best;
  }

  [[nodiscard]] FoundLight result(const Tried& tried) const {
    return {tried.light, PerMeter(tried.depth / chord_), tried.error, tried.error, 0};
  }

  [[nodiscard]] bool late() const { return is_spent(0.4, setup_.options, elapsed_); }

  SolverSetup setup_;
  const Elapsed& elapsed_;
  Hull hull_;
  Level level_;
  Eigen::Vector3d middle_;
  double radius_ = 0;  // of the box around the medium, metres
  double chord_ = 0;   // mean length of a ray inside the hull, metres
};

}  // namespace

FoundLight find_light(const SolverSetup& setup, const Light& asked, const Elapsed& elapsed) {
  return Search(setup, elapsed)(asked);
}

}  // namespace emberlock::recon
