// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/prepared_scene.h"

#include <cmath>
#include <utility>

#include "recon/effects/background.h"
#include "recon/effects/motion.h"
#include "recon/effects/sensor.h"
#include "recon/preprocess/check_scene.h"

namespace emberlock::recon {
namespace {

/// Without light above white, where the sensor clips.
SharedImage linear_picture(const RadianceImage& picture, const Sensor& sensor) {
  RadianceImage linear = picture;
  linearise(linear, sensor);
  return share(std::move(linear));
}

}  // namespace

Result<PreparedScene> PreparedScene::create(Scene told, const Effects& effects) {
  EMBERLOCK_RETURN_IF_ERROR(check_scene(told));
  return PreparedScene(std::move(told), effects);
}

PreparedScene::PreparedScene(Scene told, const Effects& effects) : told_(std::move(told)), effects_(effects) {
  make_linear();
  bring_together();
}

void PreparedScene::make_linear() {
  linear_ = told_;
  if (effects_.sensor.response == Sensor::Response::linear) return;
  for (View& view : linear_.views) {
    view.image = linear_picture(*view.image, effects_.sensor);
    if (view.average) view.average = linear_picture(*view.average, effects_.sensor);
    if (view.background) view.background = linear_picture(*view.background, effects_.sensor);
  }
}

void PreparedScene::bring_together() {
  const Sensor& sensor = effects_.sensor;
  const double white = sensor.clipping == Sensor::Clipping::at_white ? sensor.white : 0;
  prepared_ = moves(linear_, effects_.motion) ? at_one_instant(linear_, effects_.motion, white) : linear_;
}

PreparedScene PreparedScene::under(const Effects& effects) const {
  PreparedScene other = *this;
  other.effects_ = effects;
  const bool same_sensor = effects.sensor == effects_.sensor;
  if (!same_sensor) other.make_linear();
  if (!same_sensor || effects.motion != effects_.motion) other.bring_together();
  return other;
}

PreparedScene PreparedScene::through(const std::vector<CameraModel>& cameras) const {
  PreparedScene other = *this;
  for (std::size_t v = 0; v < cameras.size(); ++v)
    other.told_.views[v].camera = other.linear_.views[v].camera = cameras[v];
  other.bring_together();
  return other;
}

void PreparedScene::at_own_instant(RadianceImage& render, std::size_t i) const {
  const View& view = told_.views[i];
  if (!moves(told_, effects_.motion) || view.lateness == Seconds(0) || !view.average) return;
  const SharedImage& average = linear_.views[i].average;
  linearise(render, effects_.sensor);
  const RadianceImage change = change_of_place(*average, view, effects_.motion, told_.box.center);
  for (std::size_t p = 0; p < render.rgb.size(); ++p) render.rgb[p] += change.rgb[p];
  respond(render, effects_.sensor);
}

SharedImage before_background(const View& view, const Background& background) {
  if (background.kind == Background::Kind::black) return view.image;
  RadianceImage difference = *view.image;
  const RadianceImage behind = backdrop(background, view.image->size, view.background.get());
  for (std::size_t i = 0; i < difference.rgb.size(); ++i)
    difference.rgb[i] = std::abs(difference.rgb[i] - behind.rgb[i]);
  return share(std::move(difference));
}

std::vector<FlameMask> masks_before(const Scene& scene, const Background& background,
                                    std::optional<double> threshold) {
  if (background.kind == Background::Kind::black) return flame_masks(scene, threshold);
  std::vector<FlameMask> masks;
  masks.reserve(scene.views.size());
  for (const View& view : scene.views) {
    const SharedImage flame = before_background(view, background);
    masks.push_back(threshold ? flame_mask(*flame, *threshold) : noise_mask(*flame));
  }
  return masks;
}

}  // namespace emberlock::recon
