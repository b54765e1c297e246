// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "recon/calibrate/box.h"
#include "recon/calibrate/camera_model.h"
#include "recon/compute/device.h"
#include "recon/preprocess/radiance_image.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

/// A result's volume, and the temperatures of its key points, K, 0 where not told; empty where none were
/// reconstructed.
struct ShownVolume {
  Volume volume;
  std::vector<float> kelvin;
};
/// The folder of a result of `reconstruct`, or a volume.vdb. Errors: those of read_volume() and
/// read_values().
Result<ShownVolume> read_shown_volume(const std::filesystem::path& result);
Box box_of(const Grid& grid);

/// What a camera sees of a volume, before black.
struct ShownView {
  RadianceImage light;  ///< grey levels, linear
  std::vector<float>
      opacity;  ///< of each pixel, 0..1: the share of what lies behind that doesn't come through
};

/// Shows a volume's light to any cameras. What was scattered isn't in it. Throws as render_views() does.
class LightViews {
 public:
  explicit LightViews(Volume volume, const ComputeOptions& compute = {});
  [[nodiscard]] std::vector<ShownView> of(const std::vector<const CameraModel*>& cameras) const;

 private:
  Volume volume_, dark_;  // the same without its light
  ComputeOptions compute_;
};

/// Shows its temperatures: the mean along each ray, weighted by the light that reaches the camera.
class TemperatureViews {
 public:
  explicit TemperatureViews(const ShownVolume& shown, const ComputeOptions& compute = {});
  /// K; 0 where the light is less than `least`.
  [[nodiscard]] std::vector<std::vector<float>> of(const std::vector<const CameraModel*>& cameras,
                                                   float least) const;
  /// 2 % of the brightest pixel that any of these cameras sees, found in small pictures.
  [[nodiscard]] float least_light(const std::vector<CameraModel>& cameras) const;

 private:
  Volume weighted_;  // red: light times temperature; green: light
  ComputeOptions compute_;
};

}  // namespace emberlock::recon
