// SPDX-License-Identifier: Apache-2.0
// The default solver: non-negative least squares with the exact adjoint, coarse to fine.
#include <algorithm>
#include <array>
#include <limits>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "recon/adjust/descent.h"
#include "recon/adjust/left_out_views.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/tracker.h"
#include "recon/adjust/uneven_light.h"

namespace emberlock::recon {
namespace {

constexpr int kCoarsest = 24;  // no level has fewer voxels along its longest side, unless the grid itself has
constexpr int kCoarseSteps = 64;           // of a coarse level
constexpr int kMostSteps = 192;            // at full resolution, unless the user asks for more
constexpr int kRound = 16;                 // steps between two looks at the held-out pixels' error
constexpr double kMostOfSmoothness = 0.5;  // of the budget may be spent when its search goes on
constexpr double kLeastGain = 0.02;        // a round that lowers it by a smaller share is the last

int longest(const Grid& g) { return std::max({g.nx, g.ny, g.nz}) - 1; }

/// Starts a level from the coarser one's light; the extinction as it is expected under that light.
std::unique_ptr<Descent> begin(const Level& level, const SolverSetup& setup, const Engine* from) {
  const bool field = setup.effects.extinction.model == Extinction::Model::field;
  return std::make_unique<Descent>(level, setup.optics(level.problem.grid()), setup,
                                   DescentStart{from, field ? &setup.effects.extinction : nullptr});
}

/// The finest level, before its first pass.
struct Beginning {
  std::unique_ptr<const Level> level = {};
  std::unique_ptr<Descent> descent = {};  ///< of the level
  int halvings = 0;                       ///< of coarser levels
  double validation =
      std::numeric_limits<double>::infinity();  ///< of what it starts from, where that is known
  std::optional<std::size_t> started_from = {};
};

/// No descent where there is no volume to start from.
Beginning begin_with_a_start(const SolverSetup& setup) {
  Beginning begun;
  const auto& starts = setup.options.starts;
  if (starts.empty()) return begun;
  begun.level =
      std::make_unique<const Level>(make_level(setup, setup.hull, stride_for(setup, setup.hull.grid)));
  const std::optional<BestStart> best = best_start(*begun.level, setup);
  if (!best) return begun;
  begun.started_from = best->which;
  begun.validation = best->error;
  begun.descent = std::make_unique<Descent>(*begun.level, setup.optics(begun.level->problem.grid()), setup,
                                            DescentStart{nullptr, nullptr, starts[best->which].get()});
  return begun;
}

Beginning begin_coarse_to_fine(const SolverSetup& setup, Tracker& tracker) {
  std::vector<Hull> hulls = {setup.hull};
  while (longest(hulls.back().grid) >= 2 * kCoarsest) hulls.push_back(coarsen(hulls.back()));
  Beginning begun;
  for (std::size_t l = hulls.size(); l-- > 0;) {
    auto finer = std::make_unique<const Level>(make_level(setup, hulls[l], stride_for(setup, hulls[l].grid)));
    if (begun.descent) begun.descent->settle();  // nobody has judged the last pass yet
    if (begun.descent) begun.halvings += begun.descent->halvings();
    const bool is_dark = !begun.descent;
    begun.descent = begin(*finer, setup, is_dark ? nullptr : &begun.descent->engine());
    begun.level = std::move(finer);
    if (is_dark && l == 0 && setup.effects.extinction.soot.value() > 0) {  // light distributes it
      for (int s = 0; s < kCoarseSteps && !tracker.out_of_time(); s += begun.level->subsets)
        begun.descent->pass();
      begun.descent = begin(*begun.level, setup, &begun.descent->engine());
    }
    for (int s = 0; l > 0 && s < kCoarseSteps && !tracker.out_of_time(); s += begun.level->subsets)
      begun.descent->pass();
  }
  return begun;
}

/// The best of the finest level's iterations becomes the descent's x: by the held-out views where the
/// tracker says so, otherwise by the input views. `shine` renews the light that is scattered; `lowest_at` is
/// the iteration after which the input error was lowest.
struct Ending {
  Kept kept;
  std::array<double, 3> input_rmse = {};
};
template <class Shine>
Ending end_with_the_best(Descent& descent, const Tracker& tracker, const ErrorOverBoxes& error, int lowest_at,
                         const Shine& shine) {
  const auto input_rmse = [&] { return error(); };
  if (const std::optional<int> better = tracker.better_before()) {
    descent.engine().go_back();
    shine();
    if (descent.allows(descent.judge())) return {{*better, KeptBy::held_out}, input_rmse()};
  }
  const double last = descent.judge();
  const bool sound = descent.halvings() == 0 && descent.allows(last);
  const bool rose = !tracker.holds_out() && descent.kept_error() * (1 + kRiseThatCounts) < last;
  if ((!sound || rose) && descent.take_kept(last)) return {{lowest_at, KeptBy::input}, input_rmse()};
  return {{}, input_rmse()};
}

}  // namespace

Solution solve_standard(const SolverSetup& asked, Tracker& tracker) {
  SolverSetup setup = asked;
  setup.smoothness = asked.options.smoothness;
  if (!setup.smoothness)
    setup.smoothness = find_smoothness(LeftOutViews(setup, setup.hull), setup.effects.extinction, [&] {
                         return tracker.is_spent(kMostOfSmoothness);
                       }).value;
  Beginning beginning = begin_with_a_start(setup);
  if (!beginning.descent) beginning = begin_coarse_to_fine(setup, tracker);
  const std::unique_ptr<const Level>& level = beginning.level;
  const std::unique_ptr<Descent>& descent = beginning.descent;
  if (setup.effects.extinction.model == Extinction::Model::field) descent->release_extinction();

  const bool uneven = setup.scatters_unevenly();
  const ErrorOverBoxes error(setup.boxes, level->problem, descent->engine(),
                             stride_for(setup, setup.hull.grid));
  const int most = setup.options.iterations > 0 ? setup.options.iterations : kMostSteps / level->subsets;
  double last = beginning.validation;
  int iteration = 0;
  int lowest_at = 0;  // iterations before the pass that found the lowest error
  const auto shine = [&] {
    if (!uneven) return;
    const UnevenLight light(setup,
                            to_volume(descent->engine().get(), level->problem, setup.hull, setup.effects));
    descent->engine().set_offset(light(setup.views, level->problem));
    descent->begin_anew();
    tracker.add_offset(light);
  };
  while (iteration < most) {
    if (iteration > 0) shine();  // the light is known well enough to be scattered
    const Guard::Finding finding = descent->pass();
    if (finding == Guard::Finding::diverged) {  // what was taken back is no iteration
      if (tracker.out_of_time()) break;
      continue;
    }
    if (finding == Guard::Finding::best) lowest_at = iteration;
    ++iteration;
    descent->show_validation();
    if (tracker.record(iteration, error(), descent->engine(), level->problem)) break;
    if (iteration * level->subsets % kRound != 0) continue;
    const double validation = descent->validation_error();
    if (setup.options.iterations == 0 && validation > (1 - kLeastGain) * last) break;
    last = validation;
  }
  const Ending ending = end_with_the_best(*descent, tracker, error, lowest_at, shine);
  std::vector<Rgba> x = descent->engine().get();
  Volume volume = to_volume(x, level->problem, setup.hull, setup.effects);
  return {std::move(x),
          std::move(volume),
          iteration,
          beginning.halvings + descent->halvings(),
          *setup.smoothness,
          all_channels(error.black()),
          ending.input_rmse,
          ending.kept,
          beginning.started_from};
}

}  // namespace emberlock::recon
