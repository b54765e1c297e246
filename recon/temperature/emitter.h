// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "recon/calibrate/camera_response.h"

namespace emberlock::recon {

/// What is taken to glow.
enum class Emitter {
  grey,   ///< absorbs, and so emits by Kirchhoff's law, all wavelengths alike
  soot,   ///< absorbs as E(m) / wavelength
  paper,  ///< the paper's convention: green alone, one constant opacity, 1000..2300 K
};
/// "grey", "soot" or "paper"; an Error that lists them otherwise.
Result<Emitter> parse_emitter(std::string_view name);
std::string_view name(Emitter emitter);
/// What nobody told is taken for: grey.
inline Emitter taken_for(std::optional<Emitter> told) { return told.value_or(Emitter::grey); }

/// The absorption at a wavelength over that at 550 nm. Soot: E(m) / lambda of small particles (Rayleigh's
/// limit), E(m) = Im((m^2 - 1) / (m^2 + 2)), m of propane soot, 0.4 to 30 um (Chang and Charalampopoulos
/// 1990, equations 17 and 18); below 0.4 um as at 0.4 um.
double relative_absorption(Emitter emitter, double nm);

/// The paper's convention: the ends of its table, in K, and what a step of one voxel edge takes of the light.
inline constexpr double kPaperColdest = 1000, kPaperHottest = 2300, kPaperOpacityOfAStep = 0.05;

/// What an emitter of a temperature shows: level c a metre, for an absorption of 1/m at 550 nm, is value[c]
/// times exp(log_scale). `value` adds up to 1; a channel that would be below 0, outside the camera's gamut,
/// shows 0.
struct EmitterLevels {
  std::array<double, 3> value = {};
  double log_scale = 0;
};
/// Integrated anew. Any temperature from 1 to 1e5 K.
EmitterLevels levels_of(const CameraResponse& response, Emitter emitter, Kelvin temperature);
/// The same of soot whose E(m) is constant, so that it absorbs as 1 / wavelength: the other form that is in
/// use. Which of the two a flame's soot has isn't known.
EmitterLevels levels_of_constant_soot(const CameraResponse& response, Kelvin temperature);

/// levels_of() between two temperatures, tabled by 1 / T and linear between: within 1e-4 of it.
class EmitterTable {
 public:
  static constexpr double kColdest = 500, kHottest = 6000;  ///< K
  EmitterTable(const CameraResponse& response, Emitter emitter, Kelvin coldest = Kelvin(kColdest),
               Kelvin hottest = Kelvin(kHottest));

  [[nodiscard]] EmitterLevels at(Kelvin temperature) const;  ///< clamped to the table
  [[nodiscard]] Kelvin coldest() const { return coldest_; }
  [[nodiscard]] Kelvin hottest() const { return hottest_; }
  [[nodiscard]] bool absolute() const { return absolute_; }
  [[nodiscard]] Emitter emitter() const { return emitter_; }

 private:
  Emitter emitter_;
  bool absolute_;
  Kelvin coldest_, hottest_;
  std::vector<EmitterLevels> entries_;  ///< rising temperature, even in 1 / T
};

/// Chromaticity x, y of a black body by the CIE 1931 observer, and its linear sRGB with the largest channel
/// 1 and none below 0.
std::array<double, 2> chromaticity(Kelvin temperature);
std::array<double, 3> black_body_colour(Kelvin temperature);

}  // namespace emberlock::recon
