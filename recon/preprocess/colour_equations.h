// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "recon/preprocess/colour_calibration.h"
#include "recon/preprocess/colour_fit.h"

namespace emberlock::recon {

/// Equations from readings, and what they came from.
struct Equations {
  std::vector<ColourEquation> all;
  std::vector<std::size_t> reading;  ///< of each
  std::vector<ColourResidual> left_out;
  std::map<std::pair<std::string, std::size_t>, std::size_t>
      lights;  ///< unknown radiances, by name and channel
};

Equations equations_of(const ColourReadings& readings, const ColourOptions& options);

/// Dark pictures brighter than every patch are swapped, or taken with the light on.
Status check_dark(const ColourReadings& readings);

/// The same radiance with more exposure must give a larger sample.
Status check_rising(const ColourReadings& readings, const Equations& equations);

/// Whether anything says how samples grow with light: one radiance, up to known factors, seen at two of them.
bool response_told(const std::vector<ColourEquation>& equations);

/// Cameras that see no radiance at three or more distances from the middle that differ by much: nothing tells
/// their lens's falloff.
std::vector<bool> vignetting_not_told(const std::vector<ColourEquation>& equations, std::size_t cameras);

}  // namespace emberlock::recon
