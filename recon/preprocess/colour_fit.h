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
  std::size_t light = 0;  ///< index of the unknown radiance
  double known = 0;       ///< ln of exposure and of the reference radiance
  double sample = 0, variance = 0;
  double sample_sigma = 0;  ///< of the mean
  double radius_squared = 0;
  double flat = 0;         ///< ln of the flat field's value
  double floor = 0;        ///< relative deviation besides noise
  double dark_sample = 0;  ///< without light
  bool outlier = false;    ///< output
  double residual = 0;     ///< output: ln of the camera's radiance divided by the common one
  double sigma = 0;        ///< output: standard deviation of the residual
};

struct ColourUnknowns {
  std::array<double, ResponseCurve::kParameters> response = {2, 0, 0, 0};
  std::array<double, 3> log_gain = {};
  std::array<double, 3> vignetting = {};
};

struct ColourFit {
  std::vector<ColourUnknowns> cameras;
  std::vector<double> log_light;
  /// Covariance of the cameras' unknowns in order (response, log gain, vignetting; 0 for fixed ones), 10 per
  /// camera.
  Eigen::MatrixXd covariance;
};

/// The unknowns that are fixed.
struct ColourHeld {
  bool response = false;
  std::vector<std::array<bool, 3>> gain;  ///< by camera and channel
  std::vector<bool> vignetting;           ///< by camera
};

/// The joint robust fit from `start`; nullopt if the equations don't determine everything. Weights are
/// updated as the response changes.
std::optional<ColourFit> fit_colour(std::vector<ColourEquation>& equations, ColourFit start,
                                    const ColourHeld& held);

}  // namespace emberlock::recon
