// SPDX-License-Identifier: Apache-2.0
// What cameras that are milliseconds apart cost, and what is left of it once each view is rendered at its own
// instant: flames that nobody tuned the program on (recon/synthetic: seeds 11..13 in both shapes), rising
// 1 m/s, each with its own offsets, ten views, the eleventh held out. On this machine's CPU.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "base/random.h"
#include "recon/adjust/choose_effects.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/synthetic/flame.h"

using namespace emberlock;

namespace {

recon::Elapsed stopwatch() {
  const auto start = std::chrono::steady_clock::now();
  return [start] {
    return Seconds(std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  };
}

struct Run {
  double error = 0;  // held-out RMS, grey levels
  recon::EffectReport motion;
  recon::Motion found;
  double seconds = 0;
};

/// Everything is found out from the pictures.
Run reconstructed(const recon::Scene& scene) {
  const recon::Elapsed clock = stopwatch();
  const recon::Grid grid = recon::grid_over(scene.box, 128);
  recon::SolveOptions options;
  options.compute.device = recon::Device::cpu;
  const auto choice = recon::choose_effects(scene, grid, {}, options, clock);
  if (!choice.ok()) std::exit(1);
  const auto solved = recon::solve(scene, grid, choice->effects, options, clock);
  if (!solved.ok()) std::exit(1);
  return {recon::all_channels(solved->trace.back().heldout_rmse), choice->reports.back(),
          choice->effects.motion, clock().value()};
}

/// Without what it knows of its views' times.
recon::Scene unaware(recon::Scene scene) {
  for (recon::View& view : scene.views) view.lateness = Seconds(0);
  return scene;
}

recon::Scene without_averages(recon::Scene scene) {
  for (recon::View& view : scene.views) view.average.reset();
  return scene;
}

}  // namespace

/// bench_timing [REACH_MS [DRAWS]]: offsets uniform in +-REACH, DRAWS sets of them a flame.
int main(int argc, char** argv) {
  const double reach = 1e-3 * (argc > 1 ? std::atof(argv[1]) : 5.4);
  const int draws = argc > 2 ? std::atoi(argv[2]) : 1;
  std::printf("offsets uniform in +-%.1f ms, 24 frames for the averages; held-out RMS in grey levels\n\n",
              1e3 * reach);
  std::printf(
      "| flame | at once | uncorrected | corrected | no averages | late held-out view | found, m/s | seconds "
      "|\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  double sum[5] = {};
  int runs = 0;
  for (const recon::FlameShape shape : {recon::FlameShape::plume, recon::FlameShape::two_plumes})
    for (std::uint64_t seed = 11; seed <= 13; ++seed) {
      recon::PaperSceneOptions film;
      film.flame.shape = shape;
      film.flame.seed = seed;
      const Run together = reconstructed(recon::paper_scene(film));
      for (int draw = 0; draw < draws; ++draw) {
        film.averaged_frames = 24;
        film.lateness.clear();
        for (std::uint64_t i = 0; i < 11; ++i)
          film.lateness.push_back(
              Seconds(reach * (2 * random_uniform(seed, 77 + static_cast<std::uint64_t>(draw), i) - 1)));
        const recon::Scene all_late = recon::paper_scene(film);
        film.lateness.pop_back();
        const recon::Scene late = recon::paper_scene(film);
        const Run as_filmed = reconstructed(unaware(late));
        const Run corrected = reconstructed(late);
        const Run plain = reconstructed(without_averages(late));
        const Run own_instant = reconstructed(all_late);
        const double errors[5] = {together.error, as_filmed.error, corrected.error, plain.error,
                                  own_instant.error};
        for (int i = 0; i < 5; ++i) sum[i] += errors[i];
        ++runs;
        const auto& v = corrected.found.velocity;
        std::printf(
            "| %s %d | %.2f | %.2f (%.2f) | %.2f (%.2f) | %.2f (%.2f) | %.2f (%.2f) | %.2f %.2f %.2f, change "
            "%.1f | %.2f of %.2f |\n",
            shape == recon::FlameShape::plume ? "plume" : "two", static_cast<int>(seed), errors[0], errors[1],
            errors[1] / errors[0], errors[2], errors[2] / errors[0], errors[3], errors[3] / errors[0],
            errors[4], errors[4] / errors[0], v[0], v[1], v[2], corrected.motion.predicted_change,
            corrected.motion.seconds.value(), corrected.seconds);
        std::printf("      %s\n", corrected.motion.reason.c_str());
        std::fflush(stdout);
      }
    }
  std::printf("| mean | %.2f |", sum[0] / runs);
  for (int i = 1; i < 5; ++i) std::printf(" %.2f (%.2f) |", sum[i] / runs, sum[i] / sum[0]);
  std::printf("\n");
  return 0;
}
