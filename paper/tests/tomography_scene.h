// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <numbers>

#include <gtest/gtest.h>

#include "paper/baselines/method.h"
#include "recon/adjust/picture_error.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "recon/views/flame_mask.h"
#include "tests/support/ball_scene.h"

namespace emberlock::test {

/// The paper's set-up at a size for tests of tomography: the last view is held out.
inline recon::Scene tomography_scene(PerMeter extinction = PerMeter(0), int cameras = 9,
                                     ImageSize image = {80, 60}) {
  recon::PaperSceneOptions options;
  options.flame.extinction = extinction;
  options.image = image;
  options.truth_voxels = 48;
  options.truth_step = 1;
  options.cameras = cameras;
  return recon::paper_scene(options);
}

inline paper::MethodOptions with_voxels(int voxels, int threads = 0) {
  paper::MethodOptions options;
  options.voxels = voxels;
  options.compute.threads = threads;
  return options;
}

/// RMSE over the flames' boxes, all channels; grey levels.
struct TomographyErrors {
  double input = 0, input_dark = 0, held_out = 0, held_out_dark = 0;
};
inline TomographyErrors errors_of(const recon::Scene& scene, const paper::MethodResult& result) {
  const auto masks = recon::flame_masks(scene);
  TomographyErrors sum;
  double inputs = 0;
  double others = 0;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const recon::View& view = scene.views[v];
    const recon::RadianceImage shown =
        recon::render_view(result.volume, result.medium, result.effects, view.camera);
    const recon::RadianceImage dark(shown.size);
    const double error = std::pow(recon::all_channels(recon::rmse(view, shown, masks[v].box)), 2);
    const double black = std::pow(recon::all_channels(recon::rmse(view, dark, masks[v].box)), 2);
    const bool input = view.role == recon::ViewRole::input;
    (input ? sum.input : sum.held_out) += error;
    (input ? sum.input_dark : sum.held_out_dark) += black;
    (input ? inputs : others) += 1;
  }
  return {std::sqrt(sum.input / inputs), std::sqrt(sum.input_dark / inputs), std::sqrt(sum.held_out / others),
          std::sqrt(sum.held_out_dark / others)};
}

/// Of a small ball from five sides: the light that a method finds over all of it. Its lines of sight see 200
/// exp(-r^2 / 2 sigma^2), so the light is 200 2 pi sigma^2.
inline double share_of_a_balls_light(paper::RunMethod run, int voxels) {
  BallOptions ball;
  ball.views = 5;
  ball.image = {32, 24};
  const recon::Volume volume = run(ball_scene(ball), with_voxels(voxels)).value().volume;
  double light = 0;
  for (std::size_t p = 0; p < volume.grid.size(); ++p)
    light += static_cast<double>(volume.emission[3 * p]) * std::pow(volume.grid.edge, 3);
  return light / (200 * 2 * std::numbers::pi * std::pow(ball.edge / 8, 2));
}

/// What every tomographic method refuses, by the kind of the error.
inline void refuses_what_it_cant_take(paper::RunMethod run) {
  recon::Scene scene = tomography_scene(PerMeter(0), 2, {40, 30});
  EXPECT_EQ(run(scene, with_voxels(7)).error().kind, ErrorKind::bad_input);
  EXPECT_EQ(run(scene, with_voxels(16, -1)).error().kind, ErrorKind::bad_input);
  for (recon::View& view : scene.views) view.role = recon::ViewRole::held_out;
  EXPECT_EQ(run(scene, with_voxels(16)).error().kind, ErrorKind::bad_input);
}

}  // namespace emberlock::test
