// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "recon/preprocess/colour.h"
#include "recon/preprocess/colour_readings.h"

namespace emberlock::recon {

// Responses, gains and vignettings of all cameras together, from patches of a shared target: one robust least
// squares fit of the logarithms of
//   (g(sample) - dark) * gain / V(r) = L * exposure,   ln g(v) = gamma ln v + sum_j c_j (1 - v)^j,  j = 1..3
// with an L for each patch, light and channel, common to all cameras. If reference radiances are given, the L
// of the patches are replaced by one L per light. The mean and variance of a patch's samples give the mean of
// g over it to second order. The dark level comes from dark pictures. After Mitsunaga and Nayar 1999
// (polynomial response) and Goldman 2010 (response and vignetting together); with the power law as a factor,
// three coefficients suffice for the differences between cameras.
//
// The deviation of flat pictures from V(r), cell by cell, is the flat field (flat_field.h).
//
// Each channel has one undetermined factor: the geometric mean of the cameras' gains is set to 1.

struct ColourOptions {
  std::optional<double> gamma = {};  ///< 0.3..5: every camera's response is this power law and isn't fitted
  double floor = 0.002;              ///< relative deviation of patches and light besides noise
};

struct ColourResidual {
  std::size_t reading = 0;  ///< index in ColourReadings::patches
  std::size_t channel = 0;
  double exposure = 0;  ///< relative, minus dark: the response applied to the reading
  double relative = 0;  ///< deviation of the camera's radiance from the cameras' common one
  ReadingUse use = ReadingUse::used;
};

struct CalibratedColour {
  std::string camera;
  Colour colour;
  double gamma = 1;                       ///< exponent of the response
  std::array<double, 3> gain_sigma = {};  ///< relative to the cameras' mean
  double corner = 1, corner_sigma = 0;    ///< light in the picture's corner
  double flat_rms = 0, flat_worst = 0;    ///< relative deviation of flat pictures from the vignetting
  double darkest = 1, brightest = 0;      ///< samples of used patches
  bool shares_patches = true;             ///< with other cameras; otherwise its gain is unknown and set to 1
  bool vignetting_known = true;           ///< otherwise set to 0: too few places
  double rms = 0;                         ///< relative, of its used readings
  std::array<int, 4> uses = {};           ///< readings by ReadingUse, over all channels
};

struct ColourCalibration {
  std::vector<CalibratedColour> cameras;
  std::vector<ColourResidual> residuals;
  double rms = 0;  ///< relative
  std::vector<std::string> warnings;
  std::vector<std::string> advice;  ///< which picture would improve it most, first
};

/// Errors: no usable patch (all saturated or dark); no information on the response (an exposure series, known
/// radiances or a given gamma); a camera whose readings fall with more light, or contradict each other; dark
/// pictures brighter than the target. Cameras that share no patch with others are marked, with a warning.
Result<ColourCalibration> calibrate_colour(const ColourReadings& readings, const ColourOptions& options = {});

}  // namespace emberlock::recon
