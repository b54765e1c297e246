// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/effects/lighting.h"
#include "recon/hull/medium.h"
#include "recon/render/in_scatter.h"
#include "recon/render/volume.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

/// A result's volume, what its medium scatters, and the temperatures of its key points, K, 0 where not told;
/// empty where none were reconstructed.
struct ShownVolume {
  Volume volume;
  Lighting lighting = {};
  std::vector<float> kelvin = {};
};
/// The folder of a result of `reconstruct`, or a volume.vdb. Errors: those of read_volume(), read_lighting()
/// and read_values().
Result<ShownVolume> read_shown_volume(const std::filesystem::path& result);
Box box_of(const Grid& grid);
/// The voxels that the medium fills; of a volume that doesn't state them those that hold anything.
Hull filled_voxels(const Volume& volume);

/// Puts another light into the place of that which a lit medium was filmed under. Where nothing shades it,
/// and of one nearby in the middle of the box, it is as bright and of the colour as that was, with what came
/// from all sides: all of `even`'s light comes from all sides, and none of the others'. `light` tells the
/// source and its place, as parse_effects() reads them. Errors: a volume that wasn't lit from outside, or is
/// empty; a light that is to be found, or stands inside of the box.
Status relight(ShownVolume& shown, Light light, const ComputeOptions& compute = {});

/// What a camera sees of a volume, before black.
struct ShownView {
  RadianceImage light;  ///< grey levels, linear
  std::vector<float>
      opacity;  ///< of each pixel, 0..1: the share of what lies behind that doesn't come through
};

/// Shows a volume's light to any cameras: what it emits, and what it scatters of that, which is computed
/// once. Throws as render_views() does.
class LightViews {
 public:
  explicit LightViews(Volume volume, const Scattering& scattering = {}, const ComputeOptions& compute = {});
  [[nodiscard]] std::vector<ShownView> of(const std::vector<const CameraModel*>& cameras) const;

 private:
  Volume volume_, dark_;  // the same without its light
  Effects effects_;
  ComputeOptions compute_;
  Hull medium_;  // of the volume
  ScatterField scattered_;
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
