// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "paper/baselines/method.h"
#include "recon/adjust/picture_error.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"

namespace emberlock::paper {

/// A flame that only emits, in pictures so small that a method takes a fraction of a second.
inline recon::Scene small_flame(int cameras) {
  recon::PaperSceneOptions options;
  options.flame.extinction = PerMeter(0);
  options.image = {80, 60};
  options.truth_voxels = 48;
  options.cameras = cameras;
  return recon::paper_scene(options);
}

inline MethodOptions at_voxels(int voxels) {
  MethodOptions options;
  options.voxels = voxels;
  return options;
}

/// Of the views of a role: the sum of their root mean squares, and darkness's.
struct ShownErrors {
  double shown = 0, dark = 0;
};
inline ShownErrors shown_errors(const recon::Scene& scene, const MethodResult& result, recon::ViewRole role) {
  ShownErrors errors;
  for (const recon::View& view : scene.views) {
    if (view.role != role) continue;
    errors.shown += recon::all_channels(
        recon::rmse(view, recon::render_view(result.volume, result.medium, result.effects, view.camera), {}));
    errors.dark += recon::all_channels(recon::rmse(view, recon::RadianceImage(view.image->size), {}));
  }
  return errors;
}

}  // namespace emberlock::paper
