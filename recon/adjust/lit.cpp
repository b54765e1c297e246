// SPDX-License-Identifier: Apache-2.0
// The default solver where light from outside is all that shines: the density alone, coarse to fine.
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <utility>
#include <vector>

#include "recon/adjust/left_out_views.h"
#include "recon/adjust/lit_descent.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/tracker.h"

namespace emberlock::recon {
namespace {

constexpr int kCoarsestLit = 24;      // voxels along the longest side, as of the default solver
constexpr int kCoarseLitPasses = 16;  // of a coarse level
constexpr int kMostLitPasses = 24;    // at full resolution, unless the user asks for more
constexpr int kLitRound = 4;          // passes between two looks at the held-out pixels' error
constexpr double kLeastLitGain = 0.01;

struct LitLevel {
  std::unique_ptr<const Level> level = {};
  std::unique_ptr<LitDescent> descent = {};
  std::optional<std::size_t> started_from = {};
  int halvings = 0;  ///< of coarser levels
};

std::unique_ptr<const Level> fine_level(const SolverSetup& setup, const Hull& hull) {
  return std::make_unique<const Level>(make_level(setup, hull, stride_for(setup, hull.grid)));
}

LitLevel from_a_start(const SolverSetup& setup) {
  LitLevel at;
  const auto& starts = setup.options.starts;
  if (starts.empty()) return at;
  at.level = fine_level(setup, setup.hull);
  const std::optional<BestStart> best = best_start(*at.level, setup);
  if (!best) return at;
  at.started_from = best->which;
  at.descent = std::make_unique<LitDescent>(*at.level, setup,
                                            DescentStart{nullptr, nullptr, starts[best->which].get()});
  return at;
}

LitLevel coarse_to_fine(const SolverSetup& setup, const Tracker& tracker) {
  std::vector<Hull> hulls = {setup.hull};
  const auto longest = [](const Grid& g) { return std::max({g.nx, g.ny, g.nz}) - 1; };
  while (longest(hulls.back().grid) >= 2 * kCoarsestLit) hulls.push_back(coarsen(hulls.back()));
  LitLevel at;
  for (std::size_t l = hulls.size(); l-- > 0;) {
    std::unique_ptr<const Level> finer = fine_level(setup, hulls[l]);
    std::unique_ptr<LitDescent> next;
    if (!at.descent) {
      const LitStart glow(*finer, setup, setup.effects.extinction);
      next = std::make_unique<LitDescent>(*finer, setup, glow.start());
    } else {
      at.descent->judge();  // makes the engine hold the density
      at.halvings += at.descent->halvings();
      next = std::make_unique<LitDescent>(*finer, setup, DescentStart{&at.descent->engine()});
      next->set_light(at.descent->light());
    }
    at.descent = std::move(next);
    at.level = std::move(finer);
    if (l > 0 && !tracker.is_spent(1)) descend(*at.descent, kCoarseLitPasses);
  }
  return at;
}

}  // namespace

Solution solve_lit(const SolverSetup& asked, Tracker& tracker) {
  SolverSetup setup = asked;
  constexpr double kMostOfSearch = 0.5;  // of the budget may be spent when the search for smoothness goes on
  setup.smoothness = asked.options.smoothness;
  if (!setup.smoothness)
    setup.smoothness = find_smoothness(LeftOutViews(setup, setup.hull), setup.effects.extinction, [&] {
                         return tracker.is_spent(kMostOfSearch);
                       }).value;
  LitLevel at = from_a_start(setup);
  if (!at.descent) at = coarse_to_fine(setup, tracker);
  LitDescent& descent = *at.descent;
  const Problem& problem = at.level->problem;
  const ErrorOverBoxes error(setup.boxes, problem, descent.engine(), stride_for(setup, setup.hull.grid));
  const int most = setup.options.iterations > 0 ? setup.options.iterations : kMostLitPasses;
  double last = std::numeric_limits<double>::infinity();
  int iteration = 0;
  int lowest_at = 0;
  while (iteration < most) {
    const Guard::Finding finding = descent.pass();
    if (finding == Guard::Finding::diverged) {
      if (tracker.out_of_time()) break;
      continue;
    }
    if (finding == Guard::Finding::best) lowest_at = iteration;
    ++iteration;
    descent.judge();
    if (tracker.record(iteration, error(), descent.engine(), problem)) break;
    if (iteration % kLitRound != 0) continue;
    const double validation = descent.validation_error();
    if (setup.options.iterations == 0 && validation > (1 - kLeastLitGain) * last) break;
    last = validation;
  }
  Kept kept;
  if (const std::optional<int> better = tracker.better_before()) {
    descent.engine().go_back();
    descent.take_from_engine();
    kept = {*better, KeptBy::held_out};
  } else if (!tracker.holds_out() && descent.take_back_a_rise()) {
    kept = {lowest_at, KeptBy::input};
  }
  descent.judge();
  std::vector<Rgba> x = descent.engine().get();
  Volume volume = to_volume(x, problem, setup.hull, setup.effects);
  return {std::move(x),      std::move(volume),
          iteration,         at.halvings + descent.halvings(),
          *setup.smoothness, all_channels(error.black()),
          error(),           kept,
          at.started_from,   descent.light()};
}

}  // namespace emberlock::recon
