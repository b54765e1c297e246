// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/prepared_scene.h"

#include <cmath>
#include <utility>

#include "recon/effects/background.h"
#include "recon/effects/motion.h"
#include "recon/effects/sensor.h"
#include "recon/views/check_scene.h"

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
  const bool same_pictures = same_sensor && effects.motion == effects_.motion;
  if (!same_pictures) other.bring_together();
  if (!same_pictures || effects.background != effects_.background)
    other.noise_masks_ = std::make_shared<NoiseMasks>();
  return other;
}

PreparedScene PreparedScene::through(const std::vector<CameraModel>& cameras) const {
  PreparedScene other = *this;
  for (std::size_t v = 0; v < cameras.size(); ++v)
    other.told_.views[v].camera = other.linear_.views[v].camera = cameras[v];
  other.bring_together();
  other.noise_masks_ = std::make_shared<NoiseMasks>();
  return other;
}

PreparedScene PreparedScene::without(const std::vector<std::size_t>& views) const {
  PreparedScene other = *this;
  for (const std::size_t v : views)
    for (Scene* scene : {&other.told_, &other.linear_, &other.prepared_})
      scene->views[v].role = ViewRole::left_out;
  return other;
}

SharedMasks PreparedScene::masks(std::optional<double> threshold, const ComputeOptions& compute) const {
  const auto find = [&] {
    return std::make_shared<const std::vector<FlameMask>>(
        masks_before(prepared_, effects_.background, threshold, compute));
  };
  if (threshold) return find();
  std::call_once(noise_masks_->once, [&] { noise_masks_->found = find(); });
  return noise_masks_->found;
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
                                    std::optional<double> threshold, const ComputeOptions& compute) {
  if (background.kind == Background::Kind::black) return flame_masks(scene, threshold, compute);
  Scene in_front = scene;
  for (View& view : in_front.views) view.image = before_background(view, background);
  return flame_masks(in_front, threshold, compute);
}

}  // namespace emberlock::recon
