// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "drivers/virtual/light_field.h"
#include "drivers/virtual/virtual_rig.h"
#include "emberlock/v1/session.pb.h"
#include "recon/synthetic/flame.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"

namespace emberlock::rig {

/// The arrangement of simulated cameras: an arc about one metre from a flame of some 15 cm, as in the paper's
/// section "Data Capture".
struct Stage {
  recon::Box box;                           ///< the flame's volume
  std::vector<recon::CameraModel> cameras;  ///< by camera of the rig
};

/// Cameras on an arc of 300 degrees, alternately above and below the flame, which fills most of the picture.
Stage demo_stage(int cameras, ImageSize image);

/// A flame with known truth, for virtual cameras. An exposure shows the flame at its middle instant.
class FlameLight final : public drivers::LightField {
 public:
  /// In which a picture gathers the flame's own levels: twice as long gives twice the light.
  static constexpr Seconds kUsualExposure = milliseconds(1);

  FlameLight(Stage stage, const recon::FlameOptions& flame, int truth_voxels);
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override;

 private:
  Stage stage_;
  recon::Flame flame_;
  recon::Grid grid_;
};

/// The flame at one instant, rendered once for each camera, so that it costs next to nothing while filming.
class StillFlame final : public drivers::LightField {
 public:
  /// Renders the flame for every camera, which takes a moment.
  StillFlame(const FlameLight& flame, const Stage& stage, TimePoint instant);
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override;

 private:
  std::vector<std::vector<float>> rgb_;  ///< by camera
};

/// A camera's stream in the manifest: identity and layout from the driver, geometry from the calibration.
v1::CameraStream describe(const drivers::CameraInfo& info, const recon::CameraModel& calibration);

}  // namespace emberlock::rig
