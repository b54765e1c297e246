// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/calibrate/camera_response.h"
#include "recon/temperature/known_emitter.h"

namespace emberlock::recon {

// A camera's absolute response from pictures of an emitter of known temperatures. Channel c is the base's,
// shifted by s, w times as wide about its middle m, its area exp(a) times the base's:
//   R_c(lambda) = exp(a) / w * base_c(m + (lambda - m - s) / w)
// The most probable a, s and ln w (maximum a posteriori, least squares by Levenberg and Marquardt), with
// priors of 10 nm for s and 15 % for w, none for a. So few levels tell what they can, and the priors the
// rest: the uncertainties say how well either does.

/// Mean levels (0..255, linear in light, black taken off) of what glows at a temperature.
struct GlowReading {
  Kelvin temperature{0};
  std::array<double, 3> level = {};
  std::array<double, 3> sigma = {};    ///< standard errors, above 0
  std::array<bool, 3> saturated = {};  ///< at white: the level is a lower bound
};

struct ResponseFitOptions {
  KnownEmitter emitter = {};
  double shift_prior = 10;      ///< nm
  double width_prior = 0.15;    ///< relative
  double floor = 0.005;         ///< relative error of levels besides `sigma`: linearity, evenness
  Kelvin temperature_sigma{0};  ///< of each reading's temperature, independent; 0: exact
};

struct FittedNumber {
  double value = 0, sigma = 0;
  /// 1 - variance / prior's variance: near 0 the prior told it, near 1 the data. A scale has no prior: 1.
  double by_data = 1;
};

struct FittedChannel {
  bool dead = false;             ///< no picture shows light in it, or the base has none: its response is 0
  FittedNumber scale = {1};      ///< of the base's area; sigma is relative
  FittedNumber shift = {0};      ///< nm
  FittedNumber width = {1};      ///< sigma is relative
  double peak = 0, peak_nm = 0;  ///< the largest R_c, levels per W / (sr m2), and where
};

struct ResponseFit {
  CameraResponse response;  ///< absolute
  std::array<FittedChannel, 3> channels;
  /// Of (a, s, ln w) of R, G and B, 9 x 9, s in nm; rows of dead channels are 0. If chi-square is larger than
  /// chance allows, it is multiplied by chi-square / freedom.
  Eigen::MatrixXd covariance;
  double chi_square = 0;                         ///< of levels and priors
  int freedom = 0;                               ///< levels less scales: what chi_square is expected to be
  std::vector<std::array<double, 3>> predicted;  ///< levels, by reading; 0 for dead channels
  std::vector<std::string> warnings;
};

inline constexpr Kelvin kColdestGlow{500}, kHottestGlow{6000};

/// Errors (bad_input): no readings or above 64; a temperature outside 500..6000 K; numbers that aren't finite
/// or an error not above 0; a base that isn't valid (camera_response.h); a reading that shows nothing in any
/// channel (3 sigma); a channel with nothing but saturated readings; a base that shows no light where a
/// channel saw some (the negative lobes of sRGB below about 1900 K).
Result<ResponseFit> fit_response(const std::vector<GlowReading>& readings, const CameraResponse& base,
                                 const ResponseFitOptions& options = {});

/// The relative standard error of each channel's level of a black body by this response; 0 for dead ones and
/// where it shows no light. `base`: that of the fit.
std::array<double, 3> level_errors(const ResponseFit& fit, const CameraResponse& base, Kelvin temperature);

/// standard_response() without its negative lobes: a sensor's channels have none.
const CameraResponse& sensor_response();

}  // namespace emberlock::recon
