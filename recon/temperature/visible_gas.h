// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "recon/calibrate/camera_response.h"
#include "recon/compute/device.h"
#include "recon/render/volume.h"
#include "recon/synthetic/flame_simulation.h"
#include "recon/views/camera_model.h"
#include "recon/views/radiance_image.h"

namespace emberlock::recon {

/// The sun above the atmosphere: a black body of 5772 K (IAU 2015) that fills 6.79e-5 sr, so 1361 W / m^2.
struct Sun {
  Eigen::Vector3d towards{1, -1, 1};  ///< direction in which it stands; not 0
  /// The share of the light taken that soot scatters, 0..0.99: about 0.2 above flames (Koylu and Faeth 1994).
  double albedo = 0.2;
};

/// What cameras of a response see of gas: soot that glows by Planck's law at its gas' temperature and, if
/// there is a sun, scatters its light once and evenly. Levels of the response a metre.
Volume visible_gas(const GasState& gas, const CameraResponse& response, const std::optional<Sun>& sun,
                   const ComputeOptions& compute);

/// The same as pictures of some cameras, in their order. Soot takes each channel's share of the light that it
/// glows with; what the sun lights is as grey as smoke.
std::vector<RadianceImage> film_gas(const GasState& gas, const CameraResponse& response,
                                    const std::optional<Sun>& sun,
                                    const std::vector<const CameraModel*>& cameras,
                                    const ComputeOptions& compute);

}  // namespace emberlock::recon
