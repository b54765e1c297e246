// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/visible_gas.h"

#include <cmath>

#include "recon/compute/pool.h"
#include "recon/render/render.h"
#include "recon/render/sunlight.h"
#include "recon/temperature/emitter.h"
#include "recon/temperature/self_absorption.h"

namespace emberlock::recon {
namespace {

constexpr Kelvin kSun{5772};
constexpr Kelvin kMiddling{1800};           // at which a channel's mean wavelength is taken
constexpr double kSunSteradian = 6.794e-5;  // pi (radius / distance)^2

void add_glow(const GasState& gas, const EmitterTable& table, Volume& volume) {
  for (std::size_t p = 0; p < gas.grid.size(); ++p) {
    const auto kelvin = static_cast<double>(gas.temperature[p]);
    if (!(gas.absorption[p] > 0) || kelvin < table.coldest().value()) continue;
    const EmitterLevels levels = table.at(Kelvin(kelvin));
    const double strength = static_cast<double>(gas.absorption[p]) * std::exp(levels.log_scale);
    for (std::size_t c = 0; c < 3; ++c)
      volume.emission[3 * p + c] += static_cast<float>(strength * levels.value[c]);
  }
}

Sunlight sunlight(const Sun& sun, const CameraResponse& response) {
  const EmitterLevels levels = levels_of(response, Emitter::grey, kSun);
  Sunlight light{sun.towards.normalized(), {}};
  for (std::size_t c = 0; c < 3; ++c)
    light.irradiance[c] = levels.value[c] * std::exp(levels.log_scale) * kSunSteradian;
  return light;
}

std::vector<RadianceImage> film_volume(const Volume& volume, const std::vector<const CameraModel*>& cameras,
                                       const ComputeOptions& compute) {
  Effects effects;
  effects.extinction.model = Extinction::Model::field;
  RenderOptions march;
  march.compute = compute;
  const std::vector<const RadianceImage*> black(cameras.size());
  return render_views(volume, whole_grid(volume.grid), effects, cameras, black, march);
}

}  // namespace

Volume visible_gas(const GasState& gas, const CameraResponse& response, const std::optional<Sun>& sun,
                   const ComputeOptions& compute) {
  Volume volume{gas.grid, std::vector<float>(3 * gas.grid.size()), gas.absorption};
  if (sun) {
    for (float& sigma : volume.extinction) sigma /= static_cast<float>(1 - sun->albedo);
    Pool pool(compute.threads);
    volume.emission = scattered_sunlight(volume, sunlight(*sun, response), sun->albedo, pool);
  }
  add_glow(gas, EmitterTable(response, Emitter::soot), volume);
  return volume;
}

std::vector<RadianceImage> film_gas(const GasState& gas, const CameraResponse& response,
                                    const std::optional<Sun>& sun,
                                    const std::vector<const CameraModel*>& cameras,
                                    const ComputeOptions& compute) {
  Volume volume = visible_gas(gas, response, sun, compute);
  if (sun) return film_volume(volume, cameras, compute);
  const auto shares = channel_absorption(response, Emitter::soot, kMiddling);
  const std::vector<float> green = volume.extinction;
  std::vector<RadianceImage> all;
  for (std::size_t c = 0; c < 3; ++c) {
    for (std::size_t p = 0; p < green.size(); ++p)
      volume.extinction[p] = green[p] * static_cast<float>(shares[c]);
    std::vector<RadianceImage> own = film_volume(volume, cameras, compute);
    if (c == 0) all.swap(own);
    for (std::size_t v = 0; c > 0 && v < all.size(); ++v)
      for (std::size_t i = c; i < all[v].rgb.size(); i += 3) all[v].rgb[i] = own[v].rgb[i];
  }
  return all;
}

}  // namespace emberlock::recon
