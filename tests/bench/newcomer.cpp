// SPDX-License-Identifier: Apache-2.0
// What someone waits for who gives `emberlock reconstruct` twelve pictures and nothing else.
//   bench_newcomer write FOLDER    twelve views of a simulated flame, 640 x 480, and their transforms.json
//   bench_newcomer trace [VOXELS [HELD_OUT]]   what the held-out trace costs, in processor time
// The wait itself: time build/release/bin/emberlock reconstruct FOLDER/transforms.json --out FOLDER-result
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <numbers>
#include <string_view>

#include "recon/adjust/picture_error.h"
#include "recon/adjust/solver.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "tests/support/scene_files.h"

using namespace emberlock;
namespace fs = std::filesystem;

namespace {

constexpr ImageSize kPicture{640, 480};
constexpr int kViews = 12;

/// paper_scene()'s flame and distances, from twelve sides.
recon::Scene twelve_views() {
  recon::Scene scene;
  scene.box = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)};
  recon::FlameOptions options;
  options.seed = 11;  // nothing was tuned on it
  const recon::FlameTruth truth = recon::Flame(options).at(Seconds(0), recon::grid_over(scene.box, 192));
  recon::RenderOptions finer;
  finer.step = 0.5;
  const double focal = kPicture.width / 2 * std::numbers::sqrt3;  // 60 degrees across
  for (int i = 0; i < kViews; ++i) {
    const double a = 2 * std::numbers::pi * i / kViews;
    const double e = (i % 2 == 0 ? 1 : -1) * std::numbers::pi / 18;
    const Eigen::Vector3d at(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
    recon::View view{"camera " + std::to_string(i),
                     recon::look_at({kPicture, focal, focal, 0.5 * kPicture.width, 0.5 * kPicture.height, {}},
                                    0.3 * at, Eigen::Vector3d::Zero()),
                     {}};
    view.image =
        recon::share(recon::render_view(truth.volume, truth.medium, truth.effects, view.camera, finer));
    scene.views.push_back(std::move(view));
  }
  return scene;
}

int write(const fs::path& folder) {
  if (const Status written = test::write_scene(twelve_views(), folder); !written.ok()) {
    std::fprintf(stderr, "%s\n", written.error().message().c_str());
    return 1;
  }
  std::printf("%s\n", (folder / "transforms.json").c_str());
  return 0;
}

/// Of all of this process's threads, so other work on the machine doesn't count.
Seconds processor_time() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return Seconds(static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec));
}

int trace(int voxels, int held_out) {
  recon::Scene scene = twelve_views();
  for (int i = 0; i < held_out; ++i)
    scene.views[static_cast<std::size_t>(5 * i % kViews)].role = recon::ViewRole::held_out;
  recon::SolveOptions options;
  options.compute.device = recon::Device::cpu;
  recon::Effects effects;
  effects.extinction = {recon::Extinction::Model::field, recon::FlameOptions().extinction, PerMeter(0)};
  const auto solved =
      recon::solve(scene, recon::grid_over(scene.box, voxels), effects, options, processor_time);
  if (!solved.ok() || !solved->heldout_rmse) return 1;
  const double all = (solved->hull_time + solved->solve_time + solved->trace_time).value();
  std::printf(
      "%d voxels, %d of %d views held out, %d iterations: %.2f s of processor, %.3f s (%.1f %%) for the "
      "trace from "
      "%zu of %zu pixels; held-out error %.2f grey levels\n",
      voxels, held_out, kViews, solved->iterations, all, solved->trace_time.value(),
      100 * solved->trace_time.value() / all, solved->trace_sample.pixels, solved->trace_sample.of,
      recon::all_channels(*solved->heldout_rmse));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  if (what == "write" && argc == 3) return write(argv[2]);
  if (what == "trace") return trace(argc > 2 ? std::atoi(argv[2]) : 128, argc > 3 ? std::atoi(argv[3]) : 2);
  std::fprintf(stderr, "bench_newcomer write FOLDER | bench_newcomer trace [VOXELS [HELD_OUT]]\n");
  return 2;
}
