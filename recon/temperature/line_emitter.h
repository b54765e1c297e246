// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// Light of an even spectrum between two wavelengths; of one wavelength where both are the same.
struct LineBand {
  double from_nm = 0, to_nm = 0;
  double strength = 1;  ///< power, relative to the emitter's other bands
};

/// What shines in lines or narrow bands, and so is no black body.
struct LineEmitter {
  std::string_view name;  ///< as --lines takes it
  std::string_view what;
  std::vector<LineBand> bands;
};
/// Sodium, potassium, lithium, CH, C2, copper's chloride and hydroxide, boron's dioxide. The sources of their
/// wavelengths and strengths stand beside them.
const std::vector<LineEmitter>& line_emitters();

/// Which of them are looked for beside the soot.
struct LineRequest {
  std::vector<const LineEmitter*> named = {};
  bool automatic = false;  ///< the one that best explains what no soot does
  [[nodiscard]] bool any() const { return automatic || !named.empty(); }
};
inline constexpr std::size_t kMostLines = 2;  ///< three channels and an extinction tell no more beside soot
/// Names between commas, "auto", or nothing; an Error that lists them otherwise.
Result<LineRequest> parse_lines(std::string_view words);

/// What a camera makes of an emission of 1 W / (sr m^3): levels a metre. A channel may be below 0, where the
/// line is outside the camera's gamut: it then takes from what shines beside it.
std::array<double, 3> levels_of(const CameraResponse& response, const LineEmitter& emitter);
/// What it shows of it alone: no channel below 0.
std::array<double, 3> shown_alone(const std::array<double, 3>& levels);
/// Whether it shows more than a thousandth of what it shows at its best wavelength.
bool is_seen(const CameraResponse& response, const LineEmitter& emitter);

/// Between 0, one colour, and 1, no channel in common: the sine of the angle between what each shows alone.
double colour_distance(const std::array<double, 3>& a, const std::array<double, 3>& b);
inline constexpr double kOneColour = 0.02;  ///< a distance below which a camera can't tell two colours
/// The temperature whose colour is the line's; nothing if none is.
std::optional<Kelvin> as_if_hot(const EmitterTable& table, const std::array<double, 3>& line);

/// Whether a camera could tell these lines beside this emitter. Errors: the paper's convention has green
/// alone; a line beyond the camera's range; two of one colour; more amounts than channels.
Status check_lines(const CameraResponse& response, Emitter emitter, const LineRequest& lines);

}  // namespace emberlock::recon
