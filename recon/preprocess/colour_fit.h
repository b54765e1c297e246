// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "recon/preprocess/colour_model.h"

namespace emberlock::recon {

/// One reading of one channel in the joint fit.
struct ColourEquation {
  std::size_t camera = 0, channel = 0;
  std::size_t light = 0;  ///< which unknown radiance
  double known = 0;       ///< ln of exposure and of the reference radiance
  double sample = 0, variance = 0;
  double sample_sigma = 0;  ///< of the mean
  double radius_squared = 0;
  double flat = 0;         ///< ln of the flat field's share of the light
  double floor = 0;        ///< relative: what it may be off by whatever the noise
  double dark_sample = 0;  ///< without light
  bool outlier = false;    ///< out
  double residual = 0;     ///< out: ln of the camera's radiance over the common one
  double sigma = 0;        ///< out: its standard deviation
};

struct ColourUnknowns {
  std::array<double, ResponseCurve::kParameters> response = {2, 0, 0, 0};
  std::array<double, 3> log_gain = {};
  std::array<double, 3> vignetting = {};
};

struct ColourFit {
  std::vector<ColourUnknowns> cameras;
  std::vector<double> log_light;
  /// Of the cameras' unknowns in order (response, log gain, vignetting; 0 where held), 10 a camera.
  Eigen::MatrixXd covariance;
};

/// What isn't looked for.
struct ColourHeld {
  bool response = false;
  std::vector<std::array<bool, 3>> gain;  ///< by camera and channel
  std::vector<bool> vignetting;           ///< by camera
};

/// The joint robust fit from `start`; nothing where the equations leave something open. Weights are renewed
/// as the response is found.
std::optional<ColourFit> fit_colour(std::vector<ColourEquation>& equations, ColourFit start,
                                    const ColourHeld& held);

}  // namespace emberlock::recon
