// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/two_colour_pyrometry/two_colour_pyrometry.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <functional>
#include <optional>
#include <utility>

#include "paper/baselines/damped_least_squares.h"
#include "recon/temperature/emitter.h"
#include "recon/temperature/temperature.h"

namespace emberlock::paper {
namespace {

constexpr double kColdestRatio = 1000, kHottestRatio = 3000;  // K
constexpr std::size_t kRatios = 512;

double inverse_kelvin(double place) {
  const double share = place / (kRatios - 1);
  return (1 - share) / kColdestRatio + share / kHottestRatio;
}

}  // namespace

Result<RatioThermometer> RatioThermometer::make(const recon::CameraResponse& response,
                                                recon::Emitter emitter) {
  const recon::EmitterTable table(response, emitter, Kelvin(kColdestRatio), Kelvin(kHottestRatio));
  std::vector<double> log_ratios;
  for (std::size_t i = 0; i < kRatios; ++i) {
    const auto level = table.at(Kelvin(1 / inverse_kelvin(static_cast<double>(i)))).value;
    log_ratios.push_back(std::log(level[0]) - std::log(level[1]));
  }
  const bool falls = std::adjacent_find(log_ratios.begin(), log_ratios.end(),
                                        [](double a, double b) { return !(a > b); }) == log_ratios.end();
  if (!falls || !std::isfinite(log_ratios.front()) || !std::isfinite(log_ratios.back())) {
    return Error{ErrorKind::bad_input, "red over green doesn't tell temperatures of 1000 to 3000 K",
                 "camera response", "Give the response of a camera whose red lies above its green"};
  }
  return RatioThermometer(std::move(log_ratios));
}

Result<std::optional<RatioThermometer>> RatioThermometer::told(const MethodOptions& options) {
  if (!options.response) return std::optional<RatioThermometer>();
  EMBERLOCK_ASSIGN_OR_RETURN(RatioThermometer made, make(*options.response, options.emitter));
  return std::optional(std::move(made));
}

Kelvin RatioThermometer::read(double red, double green) const {
  if (!(red > 0 && green > 0)) return Kelvin(0);
  const double ratio = std::log(red) - std::log(green);
  if (ratio > log_ratios_.front() || ratio < log_ratios_.back()) return Kelvin(0);
  const auto above =
      std::upper_bound(log_ratios_.begin() + 1, log_ratios_.end() - 1, ratio, std::greater<>());
  const auto i = static_cast<std::size_t>(above - log_ratios_.begin()) - 1;
  const double part = (log_ratios_[i] - ratio) / (log_ratios_[i] - log_ratios_[i + 1]);
  return Kelvin(1 / inverse_kelvin(static_cast<double>(i) + part));
}

std::vector<float> kelvin_by_ratio(const recon::Volume& volume, const RatioThermometer& thermometer) {
  std::vector<float> kelvin(volume.grid.size());
  std::array<float, 2> least = {};
  for (std::size_t p = 0; p < kelvin.size(); ++p)
    for (std::size_t c = 0; c < 2; ++c) least[c] = std::max(least[c], volume.emission[3 * p + c]);
  for (float& level : least) level *= static_cast<float>(recon::kShareThatCounts);
  for (std::size_t p = 0; p < kelvin.size(); ++p) {
    const float red = volume.emission[3 * p];
    const float green = volume.emission[3 * p + 1];
    if (red < least[0] || green < least[1]) continue;
    kelvin[p] =
        static_cast<float>(thermometer.read(static_cast<double>(red), static_cast<double>(green)).value());
  }
  return kelvin;
}

Result<MethodResult> two_colour_pyrometry(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<RatioThermometer> thermometer,
                             RatioThermometer::told(options));
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 2));
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  const LinearProjector projector(input.views, input.hull, 1, pool);
  DampedSolution solution = damped_least_squares(projector, kDamping, options.stop);
  clip_negative(solution.x, pool);
  EMBERLOCK_ASSIGN_OR_RETURN(MethodResult result,
                             conclude(input, projector, solution.x, solution.iterations));
  if (thermometer) result.kelvin = kelvin_by_ratio(result.volume, *thermometer);
  return result;
}

}  // namespace emberlock::paper
