// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <string>
#include <utility>

#include "recon/synthetic/flame_simulation.h"

namespace emberlock::recon {
namespace {

constexpr std::array<std::pair<FlamePreset, std::string_view>, 5> kPresetNames = {{
    {FlamePreset::candle, "candle"},
    {FlamePreset::pool_fire, "pool-fire"},
    {FlamePreset::torch, "torch"},
    {FlamePreset::two_plumes, "two-plumes"},
    {FlamePreset::smoke, "smoke"},
}};

/// Paraffin vapour from a wick, some 80 W: laminar, so gas mixes by diffusion (at flame temperature).
void make_candle(FlameSimulationOptions& o) {
  o.burners = {{Meters(0), Meters(0), Meters(0.003), 0.10}};
  o.gas.burner_temperature = 600;
  o.gas.mixing_time = 0.001F;
  o.diffusivity = 1e-4;
  o.eddies = 0;
  o.unevenness = 0;
}

}  // namespace

Result<FlamePreset> parse_flame_preset(std::string_view name) {
  std::string all;
  for (const auto& [preset, text] : kPresetNames) {
    if (text == name) return preset;
    all += (all.empty() ? "" : ", ") + std::string(text);
  }
  return Error{ErrorKind::bad_input, "no such flame", std::string(name), "Take one of " + all};
}

std::string_view name(FlamePreset preset) {
  for (const auto& [value, text] : kPresetNames)
    if (value == preset) return text;
  return "";
}

FlameSimulationOptions flame_preset(FlamePreset preset, int cells) {
  FlameSimulationOptions o;
  o.nx = o.ny = cells;
  o.nz = 2 * cells;
  o.eddies = 0.1;
  double width = 0.6;  // metres
  switch (preset) {
    case FlamePreset::candle:
      width = 0.04;
      make_candle(o);
      break;
    case FlamePreset::pool_fire:  // heptane, 0.022 kg/(m^2 s), about 1 MW/m^2
      width = 0.9;
      o.burners = {{Meters(0), Meters(0), Meters(0.15), 0.022}};
      break;
    case FlamePreset::torch:  // 14 kW
      width = 0.4;
      o.burners = {{Meters(0), Meters(0), Meters(0.01), 1.0}};
      o.gas.mixing_time = 0.004F;
      o.confinement = 0.1;
      break;
    case FlamePreset::two_plumes:
      o.burners = {{Meters(-0.08), Meters(0), Meters(0.05), 0.025},
                   {Meters(0.08), Meters(0), Meters(0.05), 0.025}};
      o.confinement = 0.05;
      break;
    case FlamePreset::smoke:
      o.burners = {{Meters(0), Meters(0), Meters(0.05), 0.5}};
      o.combustion = Combustion::none;
      o.gas.burner_temperature = 600;
      o.burner_soot = 0.01;
      o.confinement = 0.1;
      break;
  }
  o.edge = Meters(width / cells);
  return o;
}

}  // namespace emberlock::recon
