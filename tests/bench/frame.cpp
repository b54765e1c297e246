// SPDX-License-Identifier: Apache-2.0
// What one frame takes from pictures to volume and rendered views, and on a GPU what crosses the bus: ten
// views of 640 x 480, 128 voxels, nothing held out.
//   bench_frame [DEVICE [THREADS [REPEATS]]]
// On the GPU in software (scripts/build software-gpu bench_frame) the counts are a real GPU's.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <vector>

#include "base/clock.h"
#include "recon/compute/cuda_device.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"

using namespace emberlock;

namespace {

struct Took {
  double seconds = 0;
  recon::GpuWork work;
};

bool frame(const recon::Scene& scene, const recon::ReconstructOptions& options, Took& took) {
  const SteadyClock clock;
  const recon::GpuWork before = recon::gpu_work();
  const TimePoint start = clock.now();
  const auto outcome = recon::reconstruct(scene, options, clock, {}, {});
  took.seconds = (clock.now() - start).value();
  if (!outcome.ok()) {
    std::fprintf(stderr, "%s\n", outcome.error().what.c_str());
    return false;
  }
  const recon::GpuWork after = recon::gpu_work();
  took.work = {after.launches - before.launches, after.uploads - before.uploads,
               after.uploaded - before.uploaded, after.downloads - before.downloads,
               after.downloaded - before.downloaded};
  return true;
}

}  // namespace

int main(int argc, char** argv) {
  recon::PaperSceneOptions film;
  film.flame.seed = 11;
  recon::Scene scene = recon::paper_scene(film);
  scene.views.pop_back();
  recon::ReconstructOptions options;
  options.voxels = 128;
  const auto device = recon::parse_device(argc > 1 ? argv[1] : "auto");
  if (!device.ok()) return 1;
  options.solve.compute.device = *device;
  options.solve.compute.threads = argc > 2 ? std::atoi(argv[2]) : 0;
  const int repeats = argc > 3 ? std::atoi(argv[3]) : 5;

  std::printf(
      "| extinction | ms, least of %d | launches | copies to the GPU | MB | copies to the CPU | MB |\n"
      "|---|---|---|---|---|---|---|\n",
      repeats);
  for (const bool told : {true, false}) {
    if (told) {
      recon::Effects effects;
      effects.extinction = {recon::Extinction::Model::constant, film.flame.extinction, PerMeter(0)};
      options.effects = recon::EffectRequest{.fixed = effects};
    } else {
      options.effects.reset();
    }
    std::vector<Took> all(static_cast<std::size_t>(repeats));
    for (Took& took : all)
      if (!frame(scene, options, took)) return 1;
    const auto& [seconds, work] = *std::min_element(
        all.begin(), all.end(), [](const Took& a, const Took& b) { return a.seconds < b.seconds; });
    std::printf("| %s | %.1f | %llu | %llu | %.1f | %llu | %.1f |\n", told ? "told" : "found out",
                1e3 * seconds, static_cast<unsigned long long>(work.launches),
                static_cast<unsigned long long>(work.uploads), 1e-6 * static_cast<double>(work.uploaded),
                static_cast<unsigned long long>(work.downloads), 1e-6 * static_cast<double>(work.downloaded));
  }
  return 0;
}
