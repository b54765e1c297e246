// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/refractive_reconstruction/refractive_reconstruction.h"

#include <optional>
#include <utility>

#include "paper/baselines/damped_least_squares.h"
#include "paper/baselines/two_colour_pyrometry/two_colour_pyrometry.h"
#include "recon/effects/refraction.h"
#include "recon/hull/ray_list.h"

namespace emberlock::paper {
namespace {

/// |a - b|^2 over |b|^2.
double change_between(const Light& a, const Light& b, recon::Pool& pool) {
  Light difference;
  combine(a, {-1, -1, -1}, b, difference, pool);
  const double all = sum_of(dot(b, b, pool));
  return all > 0 ? sum_of(dot(difference, difference, pool)) / all : 0;
}

/// Of the key points that tell one, weighed by their red; what is assumed where none does.
Kelvin mean_of(const std::vector<float>& kelvin, const recon::Volume& volume, Kelvin assumed) {
  double sum = 0;
  double weights = 0;
  for (std::size_t p = 0; p < kelvin.size(); ++p) {
    if (!(kelvin[p] > 0)) continue;
    const auto weight = static_cast<double>(volume.emission[3 * p]);
    sum += weight * static_cast<double>(kelvin[p]);
    weights += weight;
  }
  return weights > 0 ? Kelvin(sum / weights) : assumed;
}

}  // namespace

Result<ThroughGas> reconstruct_through_gas(const TomographyInput& input, recon::Refraction refraction,
                                           const ReadTemperature& read, const std::function<bool()>& stop,
                                           recon::Pool& pool) {
  constexpr int kMostRounds = 5;
  constexpr double kSettled = 1e-3;
  refraction.rays = recon::Refraction::Rays::curved;
  const recon::CroppedHull medium = recon::crop_to_medium(input.hull);
  std::optional<recon::RefractiveIndex> gas;
  Light x;
  ThroughGas through;
  int iterations = 0;
  while (true) {
    const LinearProjector projector(input.views, input.hull, 1, pool, gas ? &*gas : nullptr);
    DampedSolution solution = damped_least_squares(projector, kDamping, stop);
    clip_negative(solution.x, pool);
    iterations += solution.iterations;
    ++through.rounds;
    const double change = x.empty() ? 1 : change_between(solution.x, x, pool);
    x = std::move(solution.x);
    const bool last = through.rounds == kMostRounds || change < kSettled * kSettled || (stop && stop());
    if (last) {
      EMBERLOCK_ASSIGN_OR_RETURN(through.result, conclude(input, projector, x, iterations));
      through.result.effects.refraction = refraction;
      return through;
    }
    if (read) refraction.flame = read(projector.volume(x), refraction.flame);
    gas.emplace(recon::assume_temperature(medium.hull, x, refraction), refraction.ambient);
  }
}

Result<MethodResult> refractive_reconstruction(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<RatioThermometer> thermometer,
                             RatioThermometer::told(options));
  EMBERLOCK_ASSIGN_OR_RETURN(const TomographyInput input, find_input(scene, options, 2));
  recon::Pool pool(options.compute.threads, recon::Device::cpu);
  ReadTemperature read;
  if (thermometer) {
    read = [&](const recon::Volume& volume, Kelvin assumed) {
      return mean_of(kelvin_by_ratio(volume, *thermometer), volume, assumed);
    };
  }
  EMBERLOCK_ASSIGN_OR_RETURN(ThroughGas through,
                             reconstruct_through_gas(input, recon::Refraction{}, read, options.stop, pool));
  if (thermometer) through.result.kelvin = kelvin_by_ratio(through.result.volume, *thermometer);
  return std::move(through.result);
}

}  // namespace emberlock::paper
