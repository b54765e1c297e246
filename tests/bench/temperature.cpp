// SPDX-License-Identifier: Apache-2.0
// How far temperatures are off: six glowing flames (seeds 11..13 of both shapes) of 1450 to 2030 K, soot that
// absorbs, ten views of 640 x 480, 16 bits, noise of 0.25 grey levels, 128^3 voxels, the truth on 192^3.
// Weighted by the true emission, over key points with soot that emit 5 % of the brightest. Salted: in one
// half of the flame sodium makes 30 % of the light, and its lowest 30 % are a blue base of C2 without soot.
//   bench_temperature [VOXELS [SEEDS [FIRST_SEED]]]
//   bench_temperature FOLDER [VOXELS]     of emberlock simulate flame
#include "recon/temperature/temperature.h"

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/clock.h"
#include "recon/adjust/choose_effects.h"
#include "recon/export/temperature_look_up.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/simulated_truth.h"

using namespace emberlock;

namespace {

struct Row {
  const char* name;
  recon::Emitter truth;
  std::optional<recon::Emitter> read;
  bool absolute;
  bool salted = false;
  const char* lines = "";
  bool together = true;
  bool spectral = false;
  bool looked_up = false;
};

constexpr Row kRows[] = {
    {"grey", recon::Emitter::grey, recon::Emitter::grey, true},
    {"grey, voxel by voxel", recon::Emitter::grey, recon::Emitter::grey, true, false, "", false},
    {"grey, relative response", recon::Emitter::grey, recon::Emitter::grey, false},
    {"grey, read as the paper does", recon::Emitter::grey, recon::Emitter::paper, true},
    {"grey, looked up by colour", recon::Emitter::grey, recon::Emitter::grey, true, false, "", false, false,
     true},
    {"soot, told, another renderer", recon::Emitter::soot, recon::Emitter::soot, true, false, "", true, true},
    {"soot, told", recon::Emitter::soot, recon::Emitter::soot, true},
    {"soot, taken for grey", recon::Emitter::soot, recon::Emitter::grey, true},
    {"soot, which nobody told", recon::Emitter::soot, {}, true},
    {"soot, looked up by colour", recon::Emitter::soot, recon::Emitter::soot, true, false, "", false, false,
     true},
    {"soot, --lines sodium,c2", recon::Emitter::soot, recon::Emitter::soot, true, false, "sodium,c2"},
    {"salted, taken for soot", recon::Emitter::soot, recon::Emitter::soot, true, true},
    {"salted, --lines sodium", recon::Emitter::soot, recon::Emitter::soot, true, true, "sodium"},
    {"salted, --lines sodium,c2", recon::Emitter::soot, recon::Emitter::soot, true, true, "sodium,c2"},
    {"salted, --lines auto", recon::Emitter::soot, recon::Emitter::soot, true, true, "auto"},
};

bool solve_and_read(int voxels, recon::FlameShape shape, int seed,
                    std::vector<test::TemperatureScore>& scores) {
  const SteadyClock clock;
  std::optional<recon::Emitter> filmed;
  bool salted = false;
  bool spectral = false;
  std::optional<test::GlowingFlame> flame;
  recon::Scene scene;
  recon::Reconstruction done;
  recon::VolumeErrors errors;
  for (std::size_t i = 0; i < std::size(kRows); ++i) {
    const Row& row = kRows[i];
    if (row.truth != filmed || row.salted != salted || row.spectral != spectral) {
      filmed = row.truth;
      salted = row.salted;
      spectral = row.spectral;
      test::GlowingFlameOptions options;
      options.film.flame.seed = static_cast<std::uint64_t>(seed);
      options.film.flame.shape = shape;
      options.emitter = row.truth;
      options.spectral = spectral;
      if (salted) {
        options.sodium = 0.3;
        options.blue_base = 0.3;
      }
      flame.emplace(options);
      scene = flame->film();
      const recon::Grid grid = recon::grid_over(scene.box, voxels);
      const TimePoint start = clock.now();
      const recon::Elapsed elapsed = [&] { return clock.now() - start; };
      const auto choice = recon::choose_effects(scene, grid, {}, {}, elapsed);
      if (!choice.ok()) return false;
      auto solved = recon::solve(scene, grid, choice->effects, {}, elapsed);
      if (!solved.ok()) return false;
      const double solve_seconds = elapsed().value();
      auto found = recon::errors_by_views(scene, *solved, {}, elapsed);
      if (!found.ok()) return false;
      std::printf("| %s %d, %s | solve %.2f s, errors %.2f s |\n",
                  shape == recon::FlameShape::plume ? "plume" : "two", seed, row.name, solve_seconds,
                  found->time.value());
      done = std::move(*solved);
      errors = std::move(*found);
    }
    recon::CameraResponse response = flame->response();
    response.absolute = row.absolute;
    const TimePoint start = clock.now();
    recon::TemperatureField field;
    if (row.looked_up)
      field.kelvin = recon::TemperatureLookUp(response, *row.read)
                         .read(done.volume.emission, Meters(static_cast<double>(done.volume.grid.edge)));
    field.sigma.resize(field.kelvin.size());
    if (!row.looked_up)
      field = recon::temperature_of(scene, row.together ? done : test::voxel_by_voxel(done), errors, response,
                                    row.read, {}, {}, *recon::parse_lines(row.lines));
    const test::TemperatureScore score = test::score_of(*flame, done, field);
    std::printf("    %-30s %s, read in %.2f s\n", row.name, test::words(score, field).c_str(),
                (clock.now() - start).value());
    for (const recon::LineSummary& line : field.summary.lines)
      std::printf("      %s: %.1f %% of the light\n", line.name.c_str(), 100 * line.share);
    scores[i].add(score);
  }
  return true;
}

/// The last frame of a folder of `emberlock simulate flame`, read as what it is: soot.
int read_simulated(const std::filesystem::path& folder, int voxels) {
  const auto fail = [](const Error& error) {
    std::fprintf(stderr, "%s\n", error.message().c_str());
    return 1;
  };
  const SteadyClock clock;
  const auto simulated = test::last_simulated(folder);
  if (!simulated.ok()) return fail(simulated.error());
  const recon::Scene* scene = &simulated->scene;
  const recon::Grid grid = recon::grid_over(scene->box, voxels);
  const TimePoint start = clock.now();
  const recon::Elapsed elapsed = [&] { return clock.now() - start; };
  const auto choice = recon::choose_effects(*scene, grid, {}, {}, elapsed);
  if (!choice.ok()) return fail(choice.error());
  const auto done = recon::solve(*scene, grid, choice->effects, {}, elapsed);
  if (!done.ok()) return fail(done.error());
  const auto errors = recon::errors_by_views(*scene, *done, {}, elapsed);
  if (!errors.ok()) return fail(errors.error());
  const test::GlowTruth glow = test::truth_on(grid, simulated->truth, simulated->kelvin);
  for (const bool together : {false, true}) {
    const TimePoint begin = clock.now();
    const recon::TemperatureField field =
        recon::temperature_of(*scene, together ? *done : test::voxel_by_voxel(*done), *errors,
                              recon::standard_response(), recon::Emitter::soot);
    if (const auto left_out = field.summary.joint.left_out)
      std::printf("solved together, views that were left out have %.4f times the misfit\n", *left_out);
    std::printf("%s, extinction %s, %s: %s, read in %.2f s\n", folder.c_str(),
                done->volume.extinction.empty() ? "off" : "on", together ? "together" : "voxel by voxel",
                test::words(test::score_of(glow, *done, field), field).c_str(),
                (clock.now() - begin).value());
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 1 && std::filesystem::is_directory(argv[1]))
    return read_simulated(argv[1], argc > 2 ? std::atoi(argv[2]) : 96);
  const int voxels = argc > 1 ? std::atoi(argv[1]) : 128;
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 3;
  const int first = argc > 3 ? std::atoi(argv[3]) : 11;
  std::vector<test::TemperatureScore> mean(std::size(kRows));
  for (int seed = first; seed < first + seeds; ++seed)
    for (const recon::FlameShape shape : {recon::FlameShape::plume, recon::FlameShape::two_plumes})
      if (!solve_and_read(voxels, shape, seed, mean)) return 1;
  std::printf(
      "\n| truth and reading | median, K | 95 %%, K | bias, K | within two sigma, %% | told, %% "
      "|\n|---|---|---|---|---|---|\n");
  for (std::size_t i = 0; i < std::size(kRows); ++i) {
    const test::TemperatureScore s = mean[i].mean();
    std::printf("| %s | %.1f | %.1f | %+.1f | %.1f | %.1f |\n", kRows[i].name, s.median, s.most, s.bias,
                100 * s.within, 100 * s.told);
  }
  return 0;
}
