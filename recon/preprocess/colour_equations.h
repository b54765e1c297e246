// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "recon/preprocess/colour_calibration.h"
#include "recon/preprocess/colour_fit.h"

namespace emberlock::recon {

/// Equations made from readings, with their origins.
struct Equations {
  std::vector<ColourEquation> all;
  std::vector<std::size_t> reading;  ///< index of the reading of each equation
  std::vector<ColourResidual> left_out;
  std::map<std::pair<std::string, std::size_t>, std::size_t>
      lights;  ///< unknown radiances, by name and channel
};

Equations equations_of(const ColourReadings& readings, const ColourOptions& options);

/// Error if dark pictures are brighter than every patch: they were swapped, or taken with the light on.
Status check_dark(const ColourReadings& readings);

/// Error if a larger exposure of the same radiance gives a smaller sample.
Status check_rising(const ColourReadings& readings, const Equations& equations);

/// Whether the response can be determined: some radiance was seen at two known ratios of exposure.
bool response_told(const std::vector<ColourEquation>& equations);

/// Cameras for which no radiance was seen at three or more clearly different distances from the middle, so
/// that the lens's falloff can't be determined.
std::vector<bool> vignetting_not_told(const std::vector<ColourEquation>& equations, std::size_t cameras);

}  // namespace emberlock::recon
