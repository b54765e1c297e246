// SPDX-License-Identifier: Apache-2.0
#include "rig/simulate/gas_light.h"

#include <cmath>

#include "recon/compute/pool.h"
#include "recon/render/sunlight.h"
#include "recon/temperature/emitter.h"

namespace emberlock::rig {
namespace {

constexpr Kelvin kSun{5772};
constexpr double kSunSteradian = 6.794e-5;  // pi (radius / distance)^2

void add_glow(const recon::GasState& gas, const recon::EmitterTable& table, recon::Volume& volume) {
  for (std::size_t p = 0; p < gas.grid.size(); ++p) {
    const auto kelvin = static_cast<double>(gas.temperature[p]);
    if (!(gas.absorption[p] > 0) || kelvin < table.coldest().value()) continue;
    const recon::EmitterLevels levels = table.at(Kelvin(kelvin));
    const double strength = static_cast<double>(gas.absorption[p]) * std::exp(levels.log_scale);
    for (std::size_t c = 0; c < 3; ++c)
      volume.emission[3 * p + c] += static_cast<float>(strength * levels.value[c]);
  }
}

recon::Sunlight sunlight(const Sun& sun, const recon::CameraResponse& response) {
  const recon::EmitterLevels levels = recon::levels_of(response, recon::Emitter::grey, kSun);
  recon::Sunlight light{sun.towards.normalized(), {}};
  for (std::size_t c = 0; c < 3; ++c)
    light.irradiance[c] = levels.value[c] * std::exp(levels.log_scale) * kSunSteradian;
  return light;
}

}  // namespace

recon::Volume visible(const recon::GasState& gas, const recon::CameraResponse& response,
                      const std::optional<Sun>& sun, const recon::ComputeOptions& compute) {
  recon::Volume volume{gas.grid, std::vector<float>(3 * gas.grid.size()), gas.absorption};
  if (sun) {
    for (float& sigma : volume.extinction) sigma /= static_cast<float>(1 - sun->albedo);
    recon::Pool pool(compute.threads);
    volume.emission = recon::scattered_sunlight(volume, sunlight(*sun, response), sun->albedo, pool);
  }
  add_glow(gas, recon::EmitterTable(response, recon::Emitter::soot), volume);
  return volume;
}

void GasLight::add_radiance(int camera, TimePoint /*exposure_start*/, Seconds /*exposure*/,
                            std::span<float> rgb) const {
  const recon::RadianceImage& picture = pictures_[static_cast<std::size_t>(camera)];
  for (std::size_t i = 0; i < rgb.size(); ++i) rgb[i] += gain_ * picture.rgb[i];
}

}  // namespace emberlock::rig
