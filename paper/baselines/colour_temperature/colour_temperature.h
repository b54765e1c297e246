// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "paper/baselines/method.h"
#include "paper/baselines/parallel_slices.h"
#include "recon/temperature/emitter.h"

namespace emberlock::paper {

inline constexpr MethodFacts kColourTemperatureFacts{"colour-temperature mapping", "Wu et al. 2014", true,
                                                     Projection::parallel,         "linear",         false};

/// Temperatures by two colours: green over red of a black body through a camera's response rises with its
/// temperature. Told up to 6000 K from where green begins, which is 500 K or, for a camera of sRGB, 962 K;
/// what lies beyond is clamped.
class TwoColours {
 public:
  /// bad_input where the ratio doesn't rise over the whole range.
  static Result<TwoColours> create(const recon::CameraResponse& response,
                                   recon::Emitter emitter = recon::Emitter::grey);

  /// Of a red and a green level, both > 0.
  [[nodiscard]] Kelvin temperature(double red, double green) const;
  /// Red, green and blue of a temperature, which add up to 1.
  [[nodiscard]] std::array<double, 3> colour(Kelvin temperature) const;

 private:
  explicit TwoColours(recon::EmitterTable table) : table_(std::move(table)) {}
  recon::EmitterTable table_;
  std::vector<double> ratio_;  ///< at temperatures even in 1 / T, rising
};

/// Which of the pictures stand at 0, 90, 45 and 135 degrees, as near as there are: the two that cross most
/// squarely, then those along their bisectors; the last two may be missing.
std::vector<std::size_t> four_views(const std::vector<ParallelPicture>& pictures);

/// Wu et al.: pixels become black bodies' temperatures; in the visual hull of four views, light and
/// temperature of every slice are the products of two orthogonal views' profiles. Temperatures through
/// options.response, else the scene's, else that of a camera that shows linear sRGB. MethodResult::kelvin is
/// told where there is light. Errors beside method.h's: no two views that cross by 10 degrees or more, an
/// empty hull, a response that tells no temperatures.
Result<MethodResult> colour_temperature(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
