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

// All cameras' responses, gains and vignettings at once, from patches of a shared target: one robust least
// squares over the logarithms of
//   (g(sample) - dark) * gain / V(r) = L * exposure,   ln g(v) = gamma ln v + sum_j c_j (1 - v)^j,  j = 1..3
// with an L for each patch, light and channel that all cameras share. A reference radiance replaces the
// patches' by their light's. Mean and variance of a patch's samples give the mean of g over it to second
// order. Dark comes from dark pictures. After Mitsunaga and Nayar 1999 (polynomial response) and Goldman 2010
// (response and vignetting together); the power law in front lets three coefficients do for what cameras
// differ by.
//
// What flat pictures show beyond V(r), cell by cell, is the flat field (flat_field.h).
//
// Known up to one factor a channel: the geometric mean of the cameras' gains is 1.

struct ColourOptions {
  std::optional<double> gamma =
      {};                ///< 0.3..5: every camera's response is this power law and isn't looked for
  double floor = 0.002;  ///< relative: what patches and light are off by whatever the noise
};

struct ColourResidual {
  std::size_t reading = 0;  ///< of ColourReadings::patches
  std::size_t channel = 0;
  double exposure = 0;  ///< relative, less dark: what the camera's response makes of it
  double relative = 0;  ///< of its radiance: the camera's over all cameras' common one, less 1
  ReadingUse use = ReadingUse::used;
};

struct CalibratedColour {
  std::string camera;
  Colour colour;
  double gamma = 1;                       ///< the response's exponent
  std::array<double, 3> gain_sigma = {};  ///< relative, to the cameras' mean
  double corner = 1, corner_sigma = 0;    ///< light in the picture's corner
  double flat_rms = 0, flat_worst = 0;    ///< relative: what flat pictures show beyond the vignetting
  double darkest = 1, brightest = 0;      ///< samples of used patches
  bool shares_patches = true;             ///< with the other cameras; else its gain is 1 and not known
  bool vignetting_known = true;           ///< else 0: too few places
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

/// Errors: no usable patch at all (all saturated, or dark); nothing that tells the response (an exposure
/// series, known radiances or a given gamma); a camera whose readings fall where light rises, or contradict
/// each other; dark pictures that are brighter than the target. Cameras that share no patch with the others
/// are a warning and marked.
Result<ColourCalibration> calibrate_colour(const ColourReadings& readings, const ColourOptions& options = {});

}  // namespace emberlock::recon
