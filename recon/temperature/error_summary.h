// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "recon/temperature/noise_errors.h"
#include "recon/temperature/view_errors.h"

namespace emberlock::recon {

/// A key point with less light than this share of the brightest has errors that nobody looks for.
inline constexpr double kLightThatCounts = 0.005;
/// The most of a key point's channels.
float light_at(const Volume& volume, std::size_t point);

/// How far a volume is off where there is light: RMS over its key points.
struct ErrorSummary {
  double light = 0;       ///< that there is, levels/m, mean of R, G and B
  double emission = 0;    ///< one standard error, levels/m
  double extinction = 0;  ///< the same, 1/m; 0 where none was reconstructed
  int solves = 0;         ///< without some of the views
  int models = 0;         ///< with another extinction
  Seconds views_time{0};
  struct Noise {
    double pixel = 0;       ///< grey levels
    double emission = 0;    ///< the error that noise alone makes, levels/m
    double extinction = 0;  ///< 1/m
    int probes = 0;
    Seconds time{0};
  };
  std::optional<Noise> noise;  ///< nothing for the paper's solver, which has no parabola, and under a light
  std::string why_no_noise;    ///< where it is worth a word
};
ErrorSummary error_summary(const Volume& volume, const VolumeErrors& errors,
                           const std::optional<NoiseErrors>& noise);

}  // namespace emberlock::recon
