// SPDX-License-Identifier: Apache-2.0
// bench_planned_time [CASES] [FIRST] [INPUT...]: what a reconstruction says that it will take, and what it
// takes, on flames, picture sizes, counts of cameras, media and noise drawn from the case's number, then on
// inputs (transforms.json or a session, the last view held out), with effects auto and none. No plan was
// tuned on them.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/random.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/pipeline/scene.h"
#include "recon/synthetic/flame.h"

namespace {

using namespace emberlock;

struct Case {
  std::string words;
  recon::Scene scene;
};

Case drawn_case(int number) {
  RandomStream numbers(43, static_cast<std::uint64_t>(number));
  const auto draw = [&] { return numbers.uniform(); };
  recon::PaperSceneOptions options;
  options.flame.shape = draw() < 0.5 ? recon::FlameShape::plume : recon::FlameShape::two_plumes;
  options.flame.seed = static_cast<std::uint64_t>(number) + 100;
  options.flame.height = Meters(0.06 + 0.12 * draw());
  const double medium = draw();
  options.flame.extinction = PerMeter(medium < 0.3 ? 0 : 60 * draw());
  options.flame.absorber = draw() < 0.5 ? recon::Absorber::medium : recon::Absorber::soot;
  options.image.width = static_cast<int>(200 * std::pow(4.0, draw()));
  options.image.height = options.image.width * 3 / 4;
  options.noise = draw() < 0.3 ? 0 : 4 * draw();
  const int views = 4 + static_cast<int>(7 * draw());
  return {fmt::format("{} views {}x{}, flame {:.2f} m, extinction {:.0f}{}, noise {:.1f}", views,
                      options.image.width, options.image.height, options.flame.height.value(),
                      options.flame.extinction.value(),
                      options.flame.absorber == recon::Absorber::soot ? " soot" : "", options.noise),
          recon::with_views(recon::paper_scene(options), views)};
}

struct Tally {
  int runs = 0;
  int within = 0;
};

void measure(const Case& c, Tally& tally) {
  const SteadyClock clock;
  for (const char* effects : {"auto", "none"}) {
    recon::ReconstructOptions options;
    options.effects = recon::parse_effects(effects).value();
    const auto plan = recon::plan_voxels(c.scene, options, clock);
    const auto outcome = recon::reconstruct(c.scene, options, clock);
    if (!plan || !outcome) {
      const Error& error = plan ? outcome.error() : plan.error();
      std::printf("   %s, %s: %s\n", c.words.c_str(), effects, error.message().c_str());
      continue;
    }
    const recon::Report& r = outcome->report;
    const double told = plan->expected_time.value();
    // The plan's knee may lie elsewhere, on a machine that was busier then.
    const char* other = plan->voxels == r.voxel_choice.voxels ? "" : "(planned with other voxels) ";
    const double ratio = r.total_time.value() / told;
    const bool within = std::abs(ratio - 1) <= 0.3;
    ++tally.runs;
    tally.within += within ? 1 : 0;
    std::printf(
        "%s %.2f = %.2f s / %.2f: effects %.2f, hull %.2f, solve %.2f, trace %.2f, render %.2f, plan %.2f; "
        "%d voxels, %d "
        "iterations, %s: %s%s\n",
        within ? "  " : "!!", ratio, r.total_time.value(), told, r.effects_time.value(), r.hull_time.value(),
        r.solve_time.value(), r.trace_time.value(), r.render_time.value(),
        r.voxel_choice.calibration_time.value(), r.voxel_choice.voxels, r.iterations, effects, other,
        c.words.c_str());
    std::fflush(stdout);
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int cases = argc > 1 ? std::atoi(argv[1]) : 10;
  const int first = argc > 2 ? std::atoi(argv[2]) : 0;
  Tally tally;
  for (int n = first; n < first + cases; ++n) measure(drawn_case(n), tally);
  for (int i = 3; i < argc; ++i) {
    auto scene = recon::load_scene(argv[i]);
    if (!scene) {
      std::fprintf(stderr, "%s\n", scene.error().message().c_str());
      return 2;
    }
    scene->views.back().role = recon::ViewRole::held_out;
    measure({argv[i], std::move(*scene)}, tally);
  }
  std::printf("\n%d of %d within 30 %%\n", tally.within, tally.runs);
  return 0;
}
