// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/stage.h"

#include <cmath>
#include <numbers>

#include "drivers/replay/record.h"
#include "recon/calibrate/rig.h"
#include "recon/render/render.h"

namespace emberlock::rig {

Stage demo_stage(int cameras, ImageSize image) {
  constexpr double kDistance = 1.0;  // metres
  constexpr double kEdge = 0.2;      // edge of the volume, metres
  constexpr double kArc = 300.0 / 180 * std::numbers::pi;
  const double focal = 0.8 * std::min(image.width, image.height) * kDistance / kEdge;
  const recon::Intrinsics intrinsics{image, focal, focal, image.width / 2.0, image.height / 2.0, {}};
  Stage stage{{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kEdge)}, {}};
  for (int i = 0; i < cameras; ++i) {
    const double azimuth = cameras > 1 ? kArc * i / (cameras - 1) : 0;
    const double height = i % 2 == 0 ? 0.12 : -0.08;
    const Eigen::Vector3d center(kDistance * std::cos(azimuth), kDistance * std::sin(azimuth), height);
    stage.cameras.push_back(recon::look_at(intrinsics, center, Eigen::Vector3d::Zero()));
  }
  return stage;
}

FlameLight::FlameLight(Stage stage, const recon::FlameOptions& flame, int truth_voxels)
    : stage_(std::move(stage)), flame_(flame), grid_(recon::grid_over(stage_.box, truth_voxels)) {}

void FlameLight::add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                              std::span<float> rgb) const {
  const Seconds middle = exposure_start - TimePoint{} + exposure / 2;
  const recon::FlameTruth truth = flame_.at(middle, grid_);
  recon::RenderOptions options;
  options.compute = {recon::Device::cpu, 1};
  const recon::RadianceImage image = recon::render_view(
      truth.volume, truth.medium, truth.effects, stage_.cameras[static_cast<std::size_t>(camera)], options);
  const auto gathered = static_cast<float>(exposure / kUsualExposure);
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] += gathered * image.rgb[i];
}

StillFlame::StillFlame(const FlameLight& flame, const Stage& stage, TimePoint instant) {
  for (std::size_t i = 0; i < stage.cameras.size(); ++i) {
    const ImageSize size = stage.cameras[i].intrinsics.size;
    rgb_.emplace_back(std::size_t{3} * static_cast<std::size_t>(size.width) *
                      static_cast<std::size_t>(size.height));
    const Seconds exposure = FlameLight::kUsualExposure;
    flame.add_radiance(static_cast<int>(i), instant + -0.5 * exposure, exposure, rgb_.back());
  }
}

void StillFlame::add_radiance(int camera, TimePoint /*exposure_start*/, Seconds exposure,
                              std::span<float> rgb) const {
  const auto gathered = static_cast<float>(exposure / FlameLight::kUsualExposure);
  const std::vector<float>& still = rgb_[static_cast<std::size_t>(camera)];
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] += gathered * still[i];
}

v1::CameraStream describe(const drivers::CameraInfo& info, const recon::CameraModel& calibration) {
  v1::CameraStream stream = drivers::to_proto(info);
  *stream.mutable_calibration() = recon::calibration_of(calibration);
  return stream;
}

}  // namespace emberlock::rig
