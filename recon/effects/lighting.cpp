// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/lighting.h"

#include <array>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

std::string levels(const std::array<double, 3>& colour) {
  return fmt::format("{:.4g} / {:.4g} / {:.4g}", colour[0], colour[1], colour[2]);
}

std::string place_of(const Light& light) {
  return fmt::format("{:.4g}, {:.4g}, {:.4g}", light.place[0], light.place[1], light.place[2]);
}

}  // namespace

Status check(const Lighting& lighting) {
  Effects effects;
  effects.extinction.model = Extinction::Model::field;
  effects.scattering = lighting.scattering;
  effects.light = lighting.light;
  EMBERLOCK_RETURN_IF_ERROR(check(effects));
  const auto refuse = [](const char* what) {
    return Error{ErrorKind::bad_input, what, "light", "Reconstruct it again"};
  };
  if (lighting.light.source == Light::Source::found) return refuse("the light isn't known");
  constexpr double kMost = 1e12;  // its products are floats; also excludes infinity
  for (const auto& colour : {lighting.light.strength, lighting.light.ambient})
    for (const double level : colour)
      if (!(level >= 0 && level <= kMost)) return refuse("the light's colours must be 0 or more");
  return {};
}

std::string words(const Scattering& scattering) {
  if (scattering.order == Scattering::Order::none) return "";
  const bool single = scattering.order == Scattering::Order::single;
  return fmt::format("{}, albedo {:.4g}, g {:.4g}", single ? "single" : "multiple", scattering.albedo,
                     scattering.asymmetry);
}

std::string words(const Light& light) {
  using Source = Light::Source;
  if (light.source == Source::none) return "";
  const std::string ambient = levels(light.ambient);
  if (light.source == Source::even) return fmt::format("even: {} grey levels from all sides", ambient);
  const std::string strength = levels(light.strength);
  const std::string from =
      light.source == Source::distant
          ? fmt::format("distant, from the direction {}: {} grey levels", place_of(light), strength)
          : fmt::format("nearby, from {} m: {} grey levels at a metre", place_of(light), strength);
  const bool from_all_sides = light.ambient != std::array<double, 3>{};
  return from_all_sides ? fmt::format("{}, and {} from all sides", from, ambient) : from;
}

}  // namespace emberlock::recon
