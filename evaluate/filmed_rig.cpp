// SPDX-License-Identifier: Apache-2.0
#include "evaluate/filmed_rig.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"

namespace emberlock::evaluate {
namespace {

constexpr Seconds kNoiseExposure = milliseconds(4);  // for which the noise is told
constexpr int kFinestTruth = 113;

/// A flame of another size, filmed from as much farther away, is this one at another speed.
recon::PaperSceneOptions drawn_flame(const RigTradeoffOptions& o) {
  recon::PaperSceneOptions scene;
  scene.flame.seed = o.seed;
  scene.flame.rise_speed = o.flame_speed * (scene.flame.height / o.flame_size);
  scene.truth_voxels = std::min(kFinestTruth, o.voxels.back() * 3 / 2 + 1);  // no solver's grid
  scene.truth_step = 1;
  return scene;
}

/// Rays along a pixel's side, so that small pictures' pixels average over as much as large ones' show.
int rays_of(const RigTradeoffOptions& o, ImageSize size) {
  return std::max(1, static_cast<int>(std::lround(1.0 * o.images.back().width / size.width)));
}

/// What the pictures depend on.
RigSetup pictures_of(RigSetup setup) {
  for (const RigAxis axis : {RigAxis::voxels, RigAxis::effects, RigAxis::device}) setup = setup.with(axis, 0);
  return setup;
}

}  // namespace

recon::View averaged(const recon::View& fine, int n, double noise, std::uint64_t seed, std::uint64_t stream) {
  recon::View view = fine;
  recon::Intrinsics& lens = view.camera.intrinsics;
  lens.size = {lens.size.width / n, lens.size.height / n};
  for (double* value : {&lens.fx, &lens.fy, &lens.cx, &lens.cy}) *value /= n;
  recon::RadianceImage image(lens.size);
  const auto side = static_cast<std::size_t>(n);
  const std::size_t row = 3 * static_cast<std::size_t>(fine.image->size.width);
  const std::size_t averaged_row = 3 * static_cast<std::size_t>(lens.size.width);
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    const std::size_t across = i % averaged_row;
    const std::size_t x = across / 3 * side;
    const std::size_t y = i / averaged_row * side;
    float sum = 0;
    for (std::size_t k = 0; k < side * side; ++k) {
      sum += fine.image->rgb[(y + k / side) * row + 3 * (x + k % side) + across % 3];
    }
    sum /= static_cast<float>(side * side);
    image.rgb[i] = std::max(0.F, sum + static_cast<float>(noise * random_normal(seed, stream, i)));
  }
  view.image = recon::share(std::move(image));
  return view;
}

recon::Scene FilmedRig::film(const RigSetup& setup) const {
  const RigTradeoffOptions& o = options_;
  const ImageSize size = o.images[setup.at(RigAxis::image)];
  const int rays = rays_of(o, size);
  recon::PaperSceneOptions options = drawn_flame(o);
  options.cameras = o.cameras[setup.at(RigAxis::cameras)];
  options.exposure = o.exposures[setup.at(RigAxis::exposure)];
  options.image = {size.width * rays, size.height * rays};
  for (int i = 0; i < options.cameras; ++i)  // the same draw for every tolerance, scaled
    options.lateness.push_back(o.tolerances[setup.at(RigAxis::tolerance)] *
                               (2 * random_uniform(o.seed, 100, static_cast<std::uint64_t>(i)) - 1));
  recon::Scene scene = recon::paper_scene(options);
  const double noise = o.noise * std::sqrt(kNoiseExposure / options.exposure);
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    scene.views[i] = averaged(scene.views[i], rays, noise, o.seed, 200 + i);
    scene.views[i].lateness = Seconds(0);  // within the tolerance nobody knows it
  }
  return scene;
}

Result<RigFrame> FilmedRig::reconstruct(const RigSetup& setup, const Clock& clock) {
  if (!judge_) {
    recon::PaperSceneOptions options = drawn_flame(options_);
    options.cameras = 1;
    options.image = options_.images.back();
    judge_ = recon::paper_scene(options).views.back();
  }
  const RigSetup pictures = pictures_of(setup);
  if (!last_ || last_->first != pictures) {
    last_.emplace(pictures, film(setup));
    last_->second.views.back() = *judge_;
  }
  recon::ReconstructOptions options;
  options.voxels = options_.voxels[setup.at(RigAxis::voxels)];
  options.solve.compute.device = options_.devices[setup.at(RigAxis::device)];
  options.solve.compute.threads = options_.threads;
  EMBERLOCK_ASSIGN_OR_RETURN(options.effects,
                             recon::parse_effects(options_.effects[setup.at(RigAxis::effects)]));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Outcome outcome, recon::reconstruct(last_->second, options, clock));
  const recon::Report& report = outcome.report;
  return RigFrame{recon::all_channels(*report.heldout_rmse), report.effects_time.value(),
                  (report.total_time - report.effects_time).value()};
}

}  // namespace emberlock::evaluate
