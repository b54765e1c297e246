// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/prepared_scene.h"

#include <cmath>

#include "recon/effects/background.h"
#include "recon/effects/motion.h"
#include "recon/effects/sensor.h"

namespace emberlock::recon {

PreparedScene::PreparedScene(const Scene& scene, const Effects& effects) : scene_(scene) {
  const Sensor& sensor = effects.sensor;
  const bool moved = moves(scene, effects.motion);
  if (sensor.response == Sensor::Response::linear && !moved) return;
  copy_ = scene;
  const double white = sensor.clipping == Sensor::Clipping::at_white ? sensor.white : 0;
  for (View& view : copy_->views) {
    if (sensor.response != Sensor::Response::linear) {
      linearise(view.image, sensor);
      if (view.average) linearise(*view.average, sensor);
    }
    if (moved) bring_to_instant(view, effects.motion, scene.box.center, white);
    view.average.reset();
  }
}

void at_own_instant(RadianceImage& render, const Scene& scene, std::size_t i, const Effects& effects) {
  const View& view = scene.views[i];
  if (!moves(scene, effects.motion) || view.lateness == Seconds(0) || !view.average) return;
  RadianceImage average = *view.average;
  linearise(average, effects.sensor);
  linearise(render, effects.sensor);
  const RadianceImage change = change_of_place(average, view, effects.motion, scene.box.center);
  for (std::size_t p = 0; p < render.rgb.size(); ++p) render.rgb[p] += change.rgb[p];
  respond(render, effects.sensor);
}

std::vector<FlameMask> masks_before(const Scene& scene, const Background& background,
                                    std::optional<double> threshold) {
  if (background.kind == Background::Kind::black) return flame_masks(scene, threshold);
  Scene difference;
  difference.box = scene.box;
  for (const View& view : scene.views) {
    View out{view.name, view.camera, view.image, view.role};
    const RadianceImage behind =
        backdrop(background, view.image.size, view.background ? &*view.background : nullptr);
    for (std::size_t i = 0; i < out.image.rgb.size(); ++i)
      out.image.rgb[i] = std::abs(out.image.rgb[i] - behind.rgb[i]);
    difference.views.push_back(std::move(out));
  }
  return flame_masks(difference, threshold);
}

}  // namespace emberlock::recon
