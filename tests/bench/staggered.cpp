// SPDX-License-Identifier: Apache-2.0
// What staggered cameras buy and cost: held-out errors of simulated flames whose truth is known at every
// instant, filmed at 24 frames/s at once and staggered, at frames and between them.
//   bench_staggered speeds|cameras|orders [SEEDS [VOXELS]]   eleven cameras and several speeds, one speed and
//                                                            several numbers of cameras, or orders in time
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/clock.h"
#include "recon/adjust/picture_error.h"
#include "recon/adjust/volume_flow.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "recon/views/flame_mask.h"
#include "smear_sync/align/stagger.h"

using namespace emberlock;

namespace {

const Seconds kPeriod(1 / 24.0);
int voxels = 64;

struct Film {
  recon::FlameShape shape = recon::FlameShape::plume;
  std::uint64_t seed = 1;
  double speed = 1;  ///< m/s
  int cameras = 11;
};

recon::PaperSceneOptions options_of(const Film& film, Seconds time) {
  recon::PaperSceneOptions options;
  options.flame.shape = film.shape;
  options.flame.seed = film.seed;
  options.flame.rise_speed = film.speed;
  options.cameras = film.cameras;
  options.time = time;
  options.image = {4 * voxels, 3 * voxels};
  options.truth_voxels = 3 * voxels / 2;
  options.truth_step = 1;
  return options;
}

recon::Scene at_once(const Film& film, Seconds time) { return recon::paper_scene(options_of(film, time)); }

/// Each view the camera's nearest exposure.
recon::Scene staggered(const Film& film, const std::vector<Seconds>& offsets, Seconds time) {
  recon::PaperSceneOptions options = options_of(film, time);
  options.averaged_frames = 24;
  for (const Seconds offset : offsets) options.lateness.push_back(wrap_symmetric(offset - time, kPeriod));
  return recon::paper_scene(options);
}

/// Of a volume, over the flame's box in the picture of a scene's held-out view.
double error_of(const recon::Volume& volume, recon::Hull hull, const recon::Effects& effects,
                const recon::Scene& scene) {
  const recon::View& view = scene.views.back();
  std::fill(hull.inside.begin(), hull.inside.end(), std::uint8_t{1});  // flames leave the hull of a frame
  return recon::all_channels(recon::rmse(*view.image,
                                         recon::render_view(volume, hull, effects, view.camera, {}),
                                         recon::noise_mask(*view.image).box));
}

struct Solved {
  double error = 0, rise = 0;
  recon::Reconstruction reconstruction;
};
Solved solved(const recon::Scene& scene) {
  recon::ReconstructOptions options;
  options.voxels = voxels;
  options.correct_pointing = false;
  auto outcome = recon::reconstruct(scene, options, SteadyClock());
  if (!outcome.ok()) {
    std::fprintf(stderr, "%s\n", outcome.error().message().c_str());
    std::exit(1);
  }
  recon::Reconstruction& r = outcome->reconstruction;
  const double error = error_of(r.volume, r.hull, r.effects, scene);
  return {error, r.effects.motion.velocity[2], std::move(r)};
}

recon::Volume halfway(const recon::Volume& a, const recon::Volume& b) {
  recon::Volume mean = a;
  for (std::size_t i = 0; i < mean.emission.size(); ++i)
    mean.emission[i] = 0.5F * (a.emission[i] + b.emission[i]);
  for (std::size_t i = 0; i < mean.extinction.size(); ++i)
    mean.extinction[i] = 0.5F * (a.extinction[i] + b.extinction[i]);
  return mean;
}

recon::VolumeFlow scaled(recon::VolumeFlow flow, float by) {
  for (float& move : flow.move) move *= by;
  return flow;
}

enum Column { frames, shown, blended, carried, at, between, columns };
struct Errors {
  double of[columns] = {};
  double rise = 0;
};

/// Half a period after a frame: the frame's volume, the mean of both frames' volumes, and that of both
/// carried halfway by the flow between them.
void interpolate(const Film& film, Errors& errors) {
  const Solved first = solved(at_once(film, Seconds(0)));
  const Solved second = solved(at_once(film, kPeriod));
  const recon::Volume& a = first.reconstruction.volume;
  const recon::Volume& b = second.reconstruction.volume;
  const recon::Effects& effects = first.reconstruction.effects;
  const recon::Scene truth = at_once(film, kPeriod / 2);
  recon::Pool pool(0);
  const recon::VolumeFlow flow = recon::find_flow(a, b, pool);
  errors.of[frames] = std::sqrt((first.error * first.error + second.error * second.error) / 2);
  const recon::Hull& hull = first.reconstruction.hull;
  errors.of[shown] = error_of(a, hull, effects, truth);
  errors.of[blended] = error_of(halfway(a, b), hull, effects, truth);
  errors.of[carried] = error_of(
      halfway(recon::carried(a, scaled(flow, 0.5F), pool), recon::carried(b, scaled(flow, -0.5F), pool)),
      hull, effects, truth);
}

/// RMS over some instants at which a camera films, and over those halfway to the next.
void film_staggered(const Film& film, const std::vector<Seconds>& offsets, Errors& errors) {
  const Seconds apart = kPeriod / film.cameras;
  constexpr int kInstants = 2;
  double sums[2] = {};
  for (int i = 0; i < kInstants; ++i)
    for (const bool halfway : {false, true}) {
      const double place =
          std::round(static_cast<double>(i * film.cameras) / kInstants) + (halfway ? 0.5 : 0);
      const Solved one = solved(staggered(film, offsets, place * apart));
      sums[halfway ? 1 : 0] += one.error * one.error / kInstants;
      errors.rise += one.rise / (2 * kInstants);
    }
  errors.of[at] = std::sqrt(sums[0]);
  errors.of[between] = std::sqrt(sums[1]);
}

/// RMS over flames, and the worst ratio of between to at.
template <class Measure>
void line(const std::string& what, Film film, int seeds, const Measure& measure) {
  Errors all;
  double worst = 0;
  int flames = 0;
  for (const recon::FlameShape shape : {recon::FlameShape::plume, recon::FlameShape::two_plumes})
    for (int seed = 0; seed < seeds; ++seed, ++flames) {
      film.shape = shape;
      film.seed = 11 + static_cast<std::uint64_t>(seed);
      Errors one;
      measure(film, one);
      for (int c = 0; c < columns; ++c) all.of[c] += one.of[c] * one.of[c];
      all.rise += one.rise;
      worst = std::max(worst, one.of[between] / one.of[at]);
    }
  std::printf("| %s |", what.c_str());
  for (const double sum : all.of) std::printf(" %.2f |", std::sqrt(sum / flames));
  std::printf(" %.2f, %.2f | %.2f |\n", std::sqrt(all.of[between] / all.of[at]), worst, all.rise / flames);
  std::fflush(stdout);
}

void head(const char* what) {
  std::printf(
      "| %s | at once: at frames | half a period later: the frame's | mean of two | carried halfway | "
      "staggered: at frames | between | between / at, worst flame | found, m/s |\n"
      "|---|---|---|---|---|---|---|---|---|\n",
      what);
}

void measure_all(const Film& film, Errors& errors) {
  interpolate(film, errors);
  film_staggered(film, smear::staggered_offsets(static_cast<std::size_t>(film.cameras), kPeriod), errors);
}

/// Cameras that film one after the other as they stand around the flame.
void measure_in_turn(const Film& film, Errors& errors) {
  std::vector<Seconds> offsets;
  for (int i = 0; i < film.cameras; ++i) offsets.push_back(kPeriod * i / film.cameras);
  film_staggered(film, offsets, errors);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string_view what = argc > 1 ? argv[1] : "";
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 2;
  if (argc > 3) voxels = std::atoi(argv[3]);
  std::printf("held-out RMS, grey levels, over %d flames; %d voxels, 24 frames/s\n\n", 2 * seeds, voxels);
  if (what == "speeds") {
    head("flame's speed, m/s");
    for (const double speed : {0.1, 0.25, 0.5, 1.0, 2.0, 4.0})
      line(std::to_string(speed).substr(0, 4), {.speed = speed}, seeds, measure_all);
  } else if (what == "cameras") {
    head("cameras, 1 m/s");
    for (const int cameras : {6, 8, 11, 16})
      line(std::to_string(cameras), {.cameras = cameras}, seeds, measure_all);
  } else if (what == "orders") {
    head("order in time, 1 m/s");
    line("neighbours far apart", {}, seeds, [](const Film& film, Errors& errors) {
      film_staggered(film, smear::staggered_offsets(static_cast<std::size_t>(film.cameras), kPeriod), errors);
    });
    line("one after the other", {}, seeds, measure_in_turn);
  } else {
    std::fprintf(stderr, "bench_staggered speeds|cameras|orders [SEEDS [VOXELS]]\n");
    return 2;
  }
  return 0;
}
