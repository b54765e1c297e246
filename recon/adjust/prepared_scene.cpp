#include "recon/adjust/prepared_scene.h"

#include <cmath>

#include "recon/effects/background.h"
#include "recon/effects/sensor.h"

namespace emberlock {

PreparedScene::PreparedScene(const Scene& scene, const Sensor& sensor) : scene_(scene) {
  if (sensor.response == Sensor::Response::linear) return;
  linear_ = scene;
  for (View& view : linear_->views) linearise(view.image, sensor);
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

}  // namespace emberlock
