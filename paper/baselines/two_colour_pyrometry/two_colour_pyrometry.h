// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "paper/baselines/method.h"
#include "recon/calibrate/camera_response.h"
#include "recon/render/volume.h"

namespace emberlock::paper {

inline constexpr MethodFacts kTwoColourPyrometryFacts{.name = "two-colour pyrometry",
                                                      .publication = "Zhou et al. 2015",
                                                      .in_plane = false,
                                                      .projection = Projection::perspective,
                                                      .model = "linear",
                                                      .is_iterative = false};

/// The temperature of what glows by its red over its green, as a camera's response shows them, from 1000 to
/// 3000 K. Immutable, thread-safe.
class RatioThermometer {
 public:
  /// Errors: bad_input where red over green doesn't fall all the way as it gets hotter (a dead channel, one
  /// response for both).
  static Result<RatioThermometer> make(const recon::CameraResponse& response,
                                       recon::Emitter emitter = recon::Emitter::grey);
  /// The same by what a method is told; nothing where it is told no response.
  static Result<std::optional<RatioThermometer>> told(const MethodOptions& options);

  /// 0 where a channel isn't above 0, or the ratio is none of these temperatures'.
  [[nodiscard]] Kelvin read(double red, double green) const;

 private:
  explicit RatioThermometer(std::vector<double> log_ratios) : log_ratios_(std::move(log_ratios)) {}
  std::vector<double> log_ratios_;  // even in 1 / T, hotter and hotter: falling
};

/// K at a volume's key points; 0 where red or green is less than 5 % of the brightest of its channel, or
/// the thermometer tells none.
std::vector<float> kelvin_by_ratio(const recon::Volume& volume, const RatioThermometer& thermometer);

/// Each channel by damped least squares in the visual hull, then each key point's temperature by the ratio of
/// two of them, if MethodOptions::response is told. It needs two views.
Result<MethodResult> two_colour_pyrometry(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
