// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "drivers/virtual/light_field.h"
#include "drivers/virtual/virtual_rig.h"
#include "emberlock/v1/session.pb.h"
#include "recon/calibrate/box.h"
#include "recon/calibrate/camera_model.h"
#include "recon/synthetic/flame.h"

namespace emberlock::rig {

/// Where simulated cameras stand: an arc of cameras about one metre from a flame of some 15 cm, as in the
/// paper's section "Data Capture".
struct Stage {
  recon::Box box;                           ///< the flame's volume
  std::vector<recon::CameraModel> cameras;  ///< by camera of the rig
};

/// Cameras on an arc of 300 degrees, alternately above and below the flame, the flame filling most of the
/// picture.
Stage demo_stage(int cameras, ImageSize image);

/// A flame with known truth as the light that virtual cameras film. An exposure is taken as its middle
/// instant.
class FlameLight final : public drivers::LightField {
 public:
  FlameLight(Stage stage, const recon::FlameOptions& flame, int truth_voxels);
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override;

 private:
  Stage stage_;
  recon::Flame flame_;
  recon::Grid grid_;
};

/// The flame as it is at one instant, drawn once for each camera: it costs cameras that film in real time
/// next to nothing.
class StillFlame final : public drivers::LightField {
 public:
  /// Renders it for every camera, which takes a moment.
  StillFlame(const FlameLight& flame, const Stage& stage, TimePoint instant);
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override;

 private:
  std::vector<std::vector<float>> rgb_;  ///< by camera
};

/// The manifest's stream of a camera: identity and layout from the driver, geometry from its calibration.
v1::CameraStream describe(const drivers::CameraInfo& info, const recon::CameraModel& calibration);

}  // namespace emberlock::rig
