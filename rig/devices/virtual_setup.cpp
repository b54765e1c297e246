// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/virtual_setup.h"

#include <string>
#include <utility>

#include <fmt/format.h>

namespace emberlock::rig {
namespace {

constexpr Hertz kRate{23.976};
constexpr ImageSize kSize{1280, 720};

/// The row time at which rows and dummy lines take the same part of the frame period as the paper's 720 rows
/// at 54 us.
SecondsPerRow usual_row_time(int rows, Hertz rate) {
  constexpr int kDummyLines = 20;
  return microseconds_per_row(54) * (740.0 / (rows + kDummyLines) * (kRate / rate));
}

void add_cameras(const CameraConfig& camera, drivers::VirtualRigDraw draw,
                 std::vector<drivers::VirtualCameraOptions>& all) {
  const SensorKind sensor = camera.sensor.value_or(SensorKind::ccd);
  draw.layout.size = camera.request.size.value_or(kSize);
  draw.layout.format = camera.request.format.value_or(PixelFormat::gray8);
  draw.layout.bit_depth = 8 * bytes_per_sample(draw.layout.format);
  draw.rate = camera.request.frame_rate.value_or(kRate);
  draw.row_time = camera.row_time.value_or(usual_row_time(draw.layout.size.height, draw.rate));
  draw.reset = camera.reset.value_or(draw.reset);
  const std::string id = camera.id.empty() ? "virtual" : camera.id;
  for (int i = 0; i < camera.count; ++i) {
    const bool single = camera.count == 1 && !camera.id.empty();
    drivers::VirtualCameraOptions one =
        drivers::draw_virtual_camera(draw, single ? id : fmt::format("{}-{:02}", id, i), sensor);
    if (camera.request.exposure) one.exposure = camera.request.exposure;
    if (camera.shifts) one.timing.shifts = *camera.shifts;
    if (camera.direction == smear::ReadDirection::bottom_first) one.timing.direction = camera.direction;
    all.push_back(std::move(one));
  }
}

}  // namespace

Result<drivers::VirtualRigOptions> virtual_setup(const RigConfig& config) {
  drivers::VirtualRigOptions rig;
  rig.seed = config.virtual_rig.draw.seed;
  for (const CameraConfig& camera : config.cameras) {
    if (camera.source != CameraSource::virtual_) continue;
    add_cameras(camera, config.virtual_rig.draw, rig.cameras);
  }
  if (config.strobe.source == StrobeSource::manual) {
    rig.strobe.id = "manual";
    rig.strobe.dial = drivers::VirtualDialOptions{.dial = config.strobe.dial};
  }
  if (!config.virtual_rig.light.empty()) {
    rig.light =
        drivers::SharedLightOptions{config.virtual_rig.light, config.strobe.source == StrobeSource::virtual_};
  }
  switch (config.virtual_rig.scene) {
    case VirtualConfig::Scene::dark_room:
    case VirtualConfig::Scene::flame:
      rig.scene = drivers::smear_scene();
      break;
    case VirtualConfig::Scene::lit_room:
      rig.scene = drivers::lit_room_scene();
      break;
  }
  if (!rig.cameras.empty()) EMBERLOCK_RETURN_IF_ERROR(check(rig));
  return rig;
}

}  // namespace emberlock::rig
