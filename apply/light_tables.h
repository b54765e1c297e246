// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "apply/flame.h"
#include "apply/kernels/surface_light.h"
#include "recon/effects/effects.h"

namespace emberlock::apply {

/// What FallingLight needs of flames, of triangles that glow, and of light from outside, in the CPU's memory.
/// `light` is recon::Light
/// (`none`, `distant` or `nearby`, in the world) as matter of albedo 1 scatters it, so its strength is a
/// quarter of the radiance of a white surface that faces it, from a metre if it is nearby. Surfaces hide it
/// and smoke dims it; `ambient` comes everywhere.
class LightTables {
 public:
  /// At most kMostFlames of them, which must outlive it.
  LightTables(const std::vector<const Flame*>& flames, const recon::Light& light,
              const std::vector<GlowingTriangle>& panels = {});

  /// The tables must outlive it.
  [[nodiscard]] LightTable view() const {
    return {flames.data(),
            static_cast<int>(flames.size()),
            emitters.data(),
            power_until.data(),
            static_cast<std::uint32_t>(emitters.size()),
            guide.data(),
            static_cast<std::uint32_t>(guide.size()),
            panels.data(),
            static_cast<std::uint32_t>(panels.size()),
            outside};
  }

  std::vector<FlameTable> flames;
  std::vector<EmitterRow> emitters;
  std::vector<double> power_until;
  std::vector<std::uint32_t> guide;
  std::vector<GlowingTriangle> panels;
  OutsideTable outside;
};

}  // namespace emberlock::apply
