// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/quantity.h"
#include "drivers/virtual/light_field.h"
#include "recon/calibrate/camera_response.h"
#include "recon/preprocess/view.h"
#include "recon/render/volume.h"
#include "recon/synthetic/flame_simulation.h"

namespace emberlock::rig {

/// The sun above the atmosphere: a black body of 5772 K (IAU 2015) that fills 6.79e-5 sr, so 1361 W / m^2.
struct Sun {
  Eigen::Vector3d towards{1, -1, 1};  ///< direction in which it stands; not 0
  /// The share of the light taken that soot scatters, 0..0.99: about 0.2 above flames (Koylu and Faeth 1994).
  double albedo = 0.2;
};

/// What cameras of a response see of gas: soot that glows by Planck's law at its gas' temperature and, if
/// there is a sun, scatters its light once and evenly. Levels of the response a metre.
recon::Volume visible(const recon::GasState& gas, const recon::CameraResponse& response,
                      const std::optional<Sun>& sun, const recon::ComputeOptions& compute);

/// The gas as pictures that were rendered for an instant: what virtual cameras film of it.
class GasLight final : public drivers::LightField {
 public:
  explicit GasLight(int cameras) : pictures_(static_cast<std::size_t>(cameras)) {}

  /// Before that camera's next frame is fetched, and not meanwhile.
  void show(std::size_t camera, recon::RadianceImage picture) { pictures_[camera] = std::move(picture); }
  void set_gain(double gain) { gain_ = static_cast<float>(gain); }
  /// The pictures' levels times the gain, which holds for the exposure.
  void add_radiance(int camera, TimePoint exposure_start, Seconds exposure,
                    std::span<float> rgb) const override;

 private:
  std::vector<recon::RadianceImage> pictures_;
  float gain_ = 1;
};

}  // namespace emberlock::rig
