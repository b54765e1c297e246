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
/// The folder of a result of `reconstruct`, or a volume.vdb. Errors: those of read_volume().
Result<ShownVolume> read_shown_volume(const std::filesystem::path& result);
Box box_of(const Grid& grid);

/// What a camera sees of it, before black. What was scattered isn't in it.
struct ShownView {
  RadianceImage light;  ///< grey levels, linear
  std::vector<float>
      opacity;  ///< of each pixel, 0..1: the share of what lies behind that doesn't come through
};
std::vector<ShownView> show(const Volume& volume, const std::vector<const CameraModel*>& cameras,
                            const ComputeOptions& compute = {});

/// What a camera sees of the temperatures: the mean along each ray, weighted by the light that reaches the
/// camera; 0 where that is below `least_light`, of least_light().
std::vector<std::vector<float>> show_kelvin(const ShownVolume& shown,
                                            const std::vector<const CameraModel*>& cameras, float least_light,
                                            const ComputeOptions& compute = {});
/// 2 % of the brightest pixel that any of these cameras sees, found in small pictures.
float least_light(const ShownVolume& shown, const std::vector<const CameraModel*>& cameras,
                  const ComputeOptions& compute = {});

}  // namespace emberlock::recon
