// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/find_extinction.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <mutex>

#include "recon/adjust/cold_solve.h"

namespace emberlock::recon {
namespace {

constexpr int kCoarse = 64;           // voxels along the longest side, at most, of a coarse solution
constexpr std::size_t kRays = 30000;  // about as many pixels of the flames' boxes are looked at
// Optical depths of the mean ray: a thinner medium hardly changes the pictures, nothing is seen through a
// thicker.
constexpr double kThinnest = 1.0 / 16;
constexpr double kThickest = 4;

struct ScoredExtinction {
  Extinction extinction;
  double error = 0;
};

bool scores_better(const ScoredExtinction& a, const ScoredExtinction& b) { return a.error < b.error; }

double mean_extinction(const Extinction& e) { return e.value.value() + e.soot.value(); }

/// `soot` is the share of the mean that is distributed like soot.
Extinction guess(PerMeter mean, double soot) {
  return {Extinction::Model::field, (1 - soot) * mean, soot * mean};
}

/// Scores extinctions of one parameter, their mean: what distributes them follows from the light. A field
/// that is free would also explain what the grid is too coarse to show.
class Probe {
 public:
  static constexpr std::size_t kPixels = 20000;
  explicit Probe(const SolverSetup& setup, std::size_t pixels = kPixels) : setup_(setup) {
    const int stride = stride_for_rays(setup, pixels);
    levels_.push_back(make_level(setup, setup.hull, stride, 4));
    const std::size_t views = setup.views.size();
    const std::size_t folds = views > kFewestFitted ? std::min(kMostFolds, views) : 0;
    for (std::size_t f = 0; f < folds; ++f)
      levels_.push_back(make_level(setup, setup.hull, stride, 4, f * views / folds));
  }

  /// The geometric mean of two RMS errors, grey levels: over the validation pixels of a fit of all views, and
  /// over the views that are left out, one at a time. Both are mostly the coarse grid's own error, whose size
  /// isn't known; independent normal errors of unknown size have this likelihood. Infinite where a solve
  /// diverged.
  [[nodiscard]] ScoredExtinction score(const Extinction& extinction) const {
    std::vector<double> errors(levels_.size());
    at_once(setup_.pool, static_cast<int>(levels_.size()), [&](int n) {
      const auto at = static_cast<std::size_t>(n);
      errors[at] = validation_error(levels_[at], extinction);
    });
    double squares = 0;
    for (std::size_t f = 1; f < errors.size(); ++f) squares += errors[f] * errors[f];
    if (errors.size() == 1) return {extinction, errors[0]};
    const double of_views = std::sqrt(squares / static_cast<double>(errors.size() - 1));
    return {extinction, std::sqrt(errors[0] * of_views)};
  }

  /// Mean length of a ray inside the hull.
  [[nodiscard]] Meters mean_chord() const {
    const Problem& problem = levels_[0].problem;
    const double rays = std::max(1.0, static_cast<double>(problem.rays()));
    return Meters(total_length(problem.list, setup_.pool) / rays *
                  static_cast<double>(setup_.hull.grid.edge));
  }

 private:
  static constexpr std::size_t kMostFolds = 4;
  static constexpr std::size_t kFewestFitted = 2;  // views
  static constexpr int kSteps = 24;                // twice

  /// Every candidate takes as many steps, whatever the level's subsets.
  static void take_steps(Descent& descent, const Level& level, int steps) {
    for (int taken = 0; taken < steps; taken += level.subsets) descent.pass();
  }

  [[nodiscard]] double validation_error(const Level& level, const Extinction& extinction) const try {
    SolverSetup setup = setup_;
    setup.smoothness = kLeastSmoothness;
    Optics optics = setup.optics(level.problem.grid());
    const bool absorbs = extinction.model != Extinction::Model::none;
    optics.absorb = absorbs ? Absorb::field : Absorb::nothing;
    const Extinction even = guess(extinction.value + extinction.soot, 0);
    Descent first(level, optics, setup, {nullptr, absorbs ? &even : nullptr});
    take_steps(first, level, kSteps);
    Descent second(level, optics, setup, {&first.engine(), absorbs ? &extinction : nullptr});
    take_steps(second, level, kSteps);
    second.show_validation();
    const double error = second.validation_error();
    return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
  } catch (const Diverged&) {
    return std::numeric_limits<double>::infinity();
  }

  const SolverSetup& setup_;
  std::vector<Level> levels_;  // all views, then without one each
};

/// The lowest of the parabola through three points (place, squared error), kept inside their range.
double vertex(const std::array<double, 3>& x, const std::array<double, 3>& error) {
  const double ab = (error[1] * error[1] - error[0] * error[0]) / (x[1] - x[0]);
  const double bc = (error[2] * error[2] - error[1] * error[1]) / (x[2] - x[1]);
  const double curvature = (bc - ab) / (x[2] - x[0]);
  if (!(curvature > 0) || !std::isfinite(curvature)) return x[1];  // solves that diverged are infinite
  return std::clamp(0.5 * (x[0] + x[1]) - 0.5 * ab / curvature, x[0], x[2]);
}

/// Doubles the depth until the error has clearly risen, then tries the vertex of the parabola around the
/// best.
template <class Late>
std::vector<ScoredExtinction> search_depth(const Probe& probe, double soot, const Late& late) {
  constexpr double kClearly = 1.1;  // of nearly equal depths errors don't rise and fall smoothly
  const double chord = probe.mean_chord().value();
  const auto attempt = [&](double depth) { return probe.score(guess(PerMeter(depth / chord), soot)); };
  std::vector<ScoredExtinction> tried;
  double least = std::numeric_limits<double>::infinity();
  for (double depth = kThinnest; depth <= kThickest && !late(); depth *= 2) {
    tried.push_back(attempt(depth));
    least = std::min(least, tried.back().error);
    if (tried.back().error > kClearly * least) break;
  }
  const auto best = std::min_element(tried.begin(), tried.end(), scores_better);
  const auto at = static_cast<std::size_t>(best - tried.begin());
  if (at == 0 || at + 1 >= tried.size() || late()) return tried;
  const double octave = vertex({-1.0, 0.0, 1.0}, {tried[at - 1].error, tried[at].error, tried[at + 1].error});
  tried.push_back(attempt(kThinnest * std::exp2(static_cast<double>(at) + octave)));
  return tried;
}

/// The best candidate, with the extremes of those that are nearly as good.
EstimatedExtinction best_of(std::vector<ScoredExtinction> candidates) {
  constexpr double kHardlyWorse = 1.05;
  const ScoredExtinction best = *std::min_element(candidates.begin(), candidates.end(), scores_better);
  EstimatedExtinction estimate{best.extinction, best.error};
  std::erase_if(candidates,
                [&](const ScoredExtinction& c) { return !(c.error <= kHardlyWorse * best.error); });
  const auto [thinnest, thickest] = std::minmax_element(
      candidates.begin(), candidates.end(), [](const ScoredExtinction& a, const ScoredExtinction& b) {
        return mean_extinction(a.extinction) < mean_extinction(b.extinction);
      });
  for (const auto& extreme : {thinnest, thickest})
    if (mean_extinction(extreme->extinction) != mean_extinction(best.extinction))
      estimate.alternatives.push_back(extreme->extinction);
  return estimate;
}

Box box_around(const Grid& g) {
  const Eigen::Vector3d size = static_cast<double>(g.edge) * Eigen::Vector3d(g.nx - 1, g.ny - 1, g.nz - 1);
  return {Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>() + size / 2, size};
}

}  // namespace

Result<Hull> carve_probe(const SolverSetup& setup, const Scene& linear, const std::vector<FlameMask>& masks,
                         double refinement) {
  constexpr int kFirst = 32;
  const double probe_voxels = 4000 * std::pow(refinement, 3);
  constexpr int kRounds = 2;                    // the first coarse hull is larger than the medium
  const double pixels_wanted = 2 / refinement;  // fewer leave voxels that hang on hardly any ray
  const ComputeOptions& compute = setup.options.compute;
  EMBERLOCK_ASSIGN_OR_RETURN(Hull hull, carve(linear, masks, grid_over(linear.box, kFirst), compute));
  for (int round = 0; round < kRounds; ++round) {
    const Grid cropped = crop_to_medium(hull).hull.grid;
    const Box box = box_around(cropped);
    const auto edge = static_cast<double>(cropped.edge);
    const double smallest = edge * std::max(std::cbrt(static_cast<double>(hull.count) / probe_voxels),
                                            pixels_wanted / pixels_per_voxel(setup, cropped));
    const double voxels = std::clamp(box.size.maxCoeff() / smallest, 8.0, 128.0);
    auto finer = carve(linear, masks, grid_over(box, static_cast<int>(std::lround(voxels))), compute);
    if (!finer.ok()) break;
    hull = *std::move(finer);
  }
  return hull;
}

EstimatedExtinction find_extinction(const SolverSetup& probing, bool forced, const Elapsed& elapsed) {
  std::mutex asking;
  const auto late = [&] {
    const std::lock_guard lock(asking);  // the caller's clock need not be for several threads
    return is_spent(1.0 / 3, probing.options, elapsed);
  };
  const Probe probe(probing);
  // Where no time is left to search, a field that is asked for starts from half of what would be opaque.
  const PerMeter blind(1 / (2 * probe.mean_chord().value()));
  if (late()) return {forced ? guess(blind, 0.5) : Extinction{}};
  std::vector<ScoredExtinction> candidates;
  const ScoredExtinction none = probe.score({});
  if (!forced) candidates.push_back(none);  // stays the best among equals
  const std::vector<ScoredExtinction> mixed = search_depth(probe, 0.5, late);
  // Where no mixture lowers the error, neither of its parts does.
  if (forced || std::any_of(mixed.begin(), mixed.end(),
                            [&](const ScoredExtinction& c) { return scores_better(c, none); })) {
    std::array<std::vector<ScoredExtinction>, 2> pure;
    at_once(probing.pool, 2,
            [&](int soot) { pure[static_cast<std::size_t>(soot)] = search_depth(probe, soot, late); });
    for (const auto& tried : pure) candidates.insert(candidates.end(), tried.begin(), tried.end());
  }
  candidates.insert(candidates.end(), mixed.begin(), mixed.end());
  std::erase_if(candidates, [](const ScoredExtinction& c) { return !std::isfinite(c.error); });
  if (candidates.empty()) return {forced ? guess(blind, 0.5) : Extinction{}};
  EstimatedExtinction estimate = best_of(std::move(candidates));
  estimate.error_of_none = none.error;
  return estimate;
}

EstimatedExtinction score_closer(const SolverSetup& closer, const Extinction& extinction) {
  const Probe probe(closer, 4 * Probe::kPixels);
  return {extinction, probe.score(extinction).error, probe.score({}).error};
}

CoarseSolution try_extinction(const SolverSetup& setup, const Extinction& extinction) {
  const Hull hull = coarsen_to(setup.hull, kCoarse);
  const Level level = make_level(setup, hull, stride_for_rays(setup, kRays), 4);
  Extinction field = extinction;
  if (field.model == Extinction::Model::constant) field.model = Extinction::Model::field;
  const ColdSolve solved = cold_solve(setup, level, field);
  Effects effects;
  effects.extinction = field;
  const std::vector<Rgba> x =
      solved.engine ? solved.engine->get() : std::vector<Rgba>(level.problem.grid().size());
  return {to_volume(x, level.problem, hull, effects), hull};
}

}  // namespace emberlock::recon
