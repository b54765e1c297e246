// SPDX-License-Identifier: Apache-2.0
// How well flames are reconstructed that nobody tuned the solver on (recon/synthetic: seeds 11..13 in both
// shapes), by what the truth is and what the program is told; and the paper's method beside it. On this
// machine's CPU. With folders of `emberlock simulate flame` instead: their last frames, whose truth comes
// from the equations of burning gas; the last view is held out.
//   bench_recon [FIRST_SEED [LAST_SEED]]
//   bench_recon FOLDER...
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <thread>

#include "recon/adjust/choose_effects.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/synthetic/flame.h"
#include "tests/support/simulated_truth.h"

using namespace emberlock;

namespace {

recon::Elapsed stopwatch() {
  const auto start = std::chrono::steady_clock::now();
  return [start] {
    return Seconds(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  };
}

/// What the pictures were made with, and whether the program is told.
struct Situation {
  const char* name;
  void (*prepare)(recon::PaperSceneOptions&);
  bool told = false;        // the extinction; otherwise found out from the pictures
  bool nine_views = false;  // the tenth held out
  double budget = 0;        // seconds for hull and solve; 0: none
};

void as_it_is(recon::PaperSceneOptions&) {}

/// Noise belongs to what the solver sees, not to what judges it.
recon::Scene filmed(recon::PaperSceneOptions options, bool nine_views) {
  recon::Scene scene = recon::paper_scene(options);
  if (options.noise > 0) {
    options.noise = 0;
    scene.views.back().image = recon::paper_scene(options).views.back().image;
  }
  if (nine_views) {
    scene.views.pop_back();
    scene.views.back().role = recon::ViewRole::held_out;
  }
  return scene;
}

struct Sum {
  double error = 0, search = 0, solve = 0;
  int on = 0, count = 0;
};

bool run(const Situation& situation, recon::FlameShape shape, std::uint64_t seed, Sum& sum) {
  recon::PaperSceneOptions film;
  film.flame.shape = shape;
  film.flame.seed = seed;
  situation.prepare(film);
  const recon::Scene scene = filmed(film, situation.nine_views);
  const recon::Grid grid = recon::grid_over(scene.box, 128);
  recon::SolveOptions options;
  options.compute.device = recon::Device::cpu;
  const recon::Elapsed clock = stopwatch();
  recon::Effects effects;
  if (situation.budget > 0) options.budget = Seconds(situation.budget);
  if (situation.told) {
    effects.extinction = {recon::Extinction::Model::field, film.flame.extinction, PerMeter(0)};
  } else {
    const auto choice = recon::choose_effects(scene, grid, {}, options, clock);
    if (!choice.ok()) return false;
    effects = choice->effects;
  }
  const double search = clock().value();
  const auto r = recon::solve(scene, grid, effects, options, stopwatch());
  if (!r.ok()) return false;
  const double error = recon::all_channels(r->trace.back().heldout_rmse);
  const double solve_time = (r->hull_time + r->solve_time).value();
  const bool on = effects.extinction.model != recon::Extinction::Model::none;
  std::printf("| %-28s | %s %2d | %5.2f | %5.2f | %5.2f | %-4s %4.1f + %4.1f |\n", situation.name,
              shape == recon::FlameShape::plume ? "plume" : "two  ", static_cast<int>(seed), error, search,
              solve_time, on ? "on" : "off", effects.extinction.value.value(),
              effects.extinction.soot.value());
  sum.error += error;
  sum.search += search;
  sum.solve += solve_time;
  sum.on += on ? 1 : 0;
  ++sum.count;
  return true;
}

void paper(std::uint64_t seed) {
  recon::PaperSceneOptions film;
  film.flame.seed = seed;
  const recon::Scene scene = filmed(film, false);
  const recon::Grid grid = recon::grid_over(scene.box, 128);
  recon::SolveOptions options;
  options.compute.device = recon::Device::cpu;
  options.solver = recon::Solver::paper;
  options.iterations = 200;
  const auto r = recon::solve(
      scene, grid,
      recon::absorbing(recon::extinction_of_opacity(0.05, Meters(static_cast<double>(grid.edge)))), options,
      stopwatch());
  if (!r.ok()) return;
  std::printf("paper's solver, plume %d:", static_cast<int>(seed));
  for (const std::size_t n : {10, 30, 70, 200})
    std::printf(" %.2f", recon::all_channels(r->trace[n - 1].heldout_rmse));
  std::printf(" at 10 / 30 / 70 / 200 iterations, %.1f ms each\n",
              1e3 * r->solve_time.value() / r->iterations);
}

/// Of the emission, over the truth's RMS.
double volume_error(const recon::Volume& found, const test::GlowTruth& truth) {
  double off = 0;
  double all = 0;
  for (std::size_t i = 0; i < truth.emission.size(); ++i) {
    off += std::pow(static_cast<double>(found.emission[i] - truth.emission[i]), 2);
    all += std::pow(static_cast<double>(truth.emission[i]), 2);
  }
  return std::sqrt(off / all);
}

bool run_simulated(const std::filesystem::path& folder) {
  const auto fail = [](const Error& error) {
    std::fprintf(stderr, "%s\n", error.message().c_str());
    return false;
  };
  auto simulated = test::last_simulated(folder);
  if (!simulated.ok()) return fail(simulated.error());
  recon::Scene& scene = simulated->scene;
  scene.views.back().role = recon::ViewRole::held_out;
  recon::SolveOptions options;
  options.compute.device = recon::Device::cpu;
  for (const int voxels : {64, 96, 128}) {
    const recon::Grid grid = recon::grid_over(scene.box, voxels);
    const recon::Elapsed clock = stopwatch();
    const auto choice = recon::choose_effects(scene, grid, {}, options, clock);
    if (!choice.ok()) return fail(choice.error());
    const double search = clock().value();
    const auto r = recon::solve(scene, grid, choice->effects, options, stopwatch());
    if (!r.ok()) return fail(r.error());
    const bool on = r->effects.extinction.model != recon::Extinction::Model::none;
    std::printf("| %s | %d | %.2g | %.2f | %.1f | %.2f | %.2f | %s |\n", folder.filename().c_str(), voxels,
                static_cast<double>(grid.edge / simulated->truth.grid.edge),
                recon::all_channels(*r->heldout_rmse),
                100 * volume_error(r->volume, test::truth_on(grid, simulated->truth, simulated->kelvin)),
                search, (r->hull_time + r->solve_time).value(), on ? "on" : "off");
  }
  return true;
}

int simulated_flames(int count, char** folders) {
  std::printf(
      "| flame | voxels | voxel over the truth's | held-out | emission off, %% | search | hull + solve | "
      "extinction |\n|---|---|---|---|---|---|---|---|\n");
  for (int i = 0; i < count; ++i)
    if (!run_simulated(folders[i])) return 1;
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::filesystem::is_directory(argv[1])) return simulated_flames(argc - 1, argv + 1);
  const int first = argc > 1 ? std::atoi(argv[1]) : 11;
  const int last = argc > 2 ? std::atoi(argv[2]) : (argc > 1 ? first : 13);
  const Situation situations[] = {
      {"extinction told", as_it_is, true},
      {"extinction told, 0.25 s", as_it_is, true, false, 0.25},
      {"paper's model, same grid",
       [](recon::PaperSceneOptions& o) {
         o.truth_voxels = 128;
         o.truth_step = 1;
       }},
      {"truth on a finer grid", as_it_is},
      {"1 % noise, same grid",
       [](recon::PaperSceneOptions& o) {
         o.truth_voxels = 128;
         o.truth_step = 1;
         o.noise = 2.55;
       }},
      {"nine views, the tenth held out", as_it_is, false, true},
      {"emission only", [](recon::PaperSceneOptions& o) { o.flame.extinction = PerMeter(0); }},
      {"proportional to soot", [](recon::PaperSceneOptions& o) { o.flame.absorber = recon::Absorber::soot; }},
      {"scattering, albedo 0.5",
       [](recon::PaperSceneOptions& o) {
         o.flame.scattering = {recon::Scattering::Order::multiple, 0.5, 0};
       }},
  };
  std::printf(
      "%u hardware threads, 128^3 voxels, ten views of 640 x 480; held-out RMS in grey levels, seconds\n\n",
      std::thread::hardware_concurrency());
  std::printf("| truth | flame | held-out | search | hull + solve | extinction found (even + soot, 1/m) |\n");
  std::printf("|---|---|---|---|---|---|\n");
  Sum sums[std::size(situations)];
  for (std::size_t s = 0; s < std::size(situations); ++s)
    for (const recon::FlameShape shape : {recon::FlameShape::plume, recon::FlameShape::two_plumes})
      for (int seed = first; seed <= last; ++seed)
        if (!run(situations[s], shape, static_cast<std::uint64_t>(seed), sums[s])) return 1;
  std::printf("\n| truth | mean held-out | mean seconds in all | extinction on |\n|---|---|---|---|\n");
  for (std::size_t s = 0; s < std::size(situations); ++s)
    std::printf("| %-28s | %.2f | %.2f | %d of %d |\n", situations[s].name, sums[s].error / sums[s].count,
                (sums[s].search + sums[s].solve) / sums[s].count, sums[s].on, sums[s].count);
  std::printf("\n");
  paper(static_cast<std::uint64_t>(first));
  return 0;
}
