// SPDX-License-Identifier: Apache-2.0
#include "paper/passes.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "paper/methods.h"
#include "paper/run_errors.h"
#include "recon/adjust/choose_effects.h"
#include "recon/adjust/solver.h"
#include "recon/preprocess/radiance.h"

namespace emberlock::paper {
namespace {

constexpr std::array<int, 4> kPictured = {10, 30, 50, 70};  // the paper's figure

/// Time that isn't the method's.
class Watched {
 public:
  explicit Watched(const Clock& clock) : clock_(clock), begin_(clock.now()) {}
  [[nodiscard]] Seconds elapsed() const { return clock_.now() - begin_ - looked_; }
  template <class Look>
  void look(const Look& at) {
    const TimePoint from = clock_.now();
    at();
    looked_ += clock_.now() - from;
  }

 private:
  const Clock& clock_;
  TimePoint begin_;
  Seconds looked_{0};
};

}  // namespace

void add_passes(const Protocol& protocol, const Method& method, const KnownGas& gas,
                const recon::Scene& scene, const RunSettings& settings, const Clock& clock, MethodRun& run) {
  const bool papers = method.facts.name == kPapersMethod;
  if (!papers && method.facts.name != kDefaultMethod) return;
  const recon::Scene inputs = input_views(scene);
  const recon::Grid grid = recon::grid_over(scene.box, settings.voxels);
  recon::SolveOptions solve;
  solve.compute = settings.compute;
  solve.seed = settings.seed;
  solve.stop = settings.stop;
  Watched watched(clock);
  recon::Effects effects = papers_effects(grid);
  if (papers) {
    solve.solver = recon::Solver::paper;
    solve.flame_threshold = recon::kPaperFlameThreshold;
    solve.iterations = protocol.iterations.back();
  } else {
    const Result<recon::EffectChoice> choice = recon::choose_effects(inputs, grid, {}, solve);
    if (!choice.ok()) {
      run.passes_failed = choice.error().message();
      return;
    }
    effects = choice->effects;
  }
  std::size_t test = 0;
  while (test + 1 < scene.views.size() && scene.views[test].role == recon::ViewRole::input) ++test;
  const auto look = [&](const recon::Preview& preview) {
    const int iteration = preview.point.iteration;
    const auto& wanted = protocol.iterations;
    if (papers && std::find(wanted.begin(), wanted.end(), iteration) == wanted.end()) return;
    watched.look([&] {
      const MethodResult now{preview.volume(), preview.hull, preview.effects, iteration};
      const std::vector<recon::RadianceImage> shown = show(now, scene, settings.compute);
      const RunErrors errors = errors_of(now, shown, scene, gas);
      if (!check_finite(errors).ok()) return;
      run.points.push_back({iteration, preview.point.time, errors});
      if (papers && std::find(kPictured.begin(), kPictured.end(), iteration) != kPictured.end())
        run.pictures.push_back({fmt::format("after-{}", iteration), recon::to_rgb8(shown[test])});
    });
  };
  const auto done = recon::solve(
      inputs, grid, effects, solve, [&] { return watched.elapsed(); }, look);
  if (!done.ok()) run.passes_failed = done.error().message();
}

}  // namespace emberlock::paper
