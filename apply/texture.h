// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace emberlock::apply {

/// A picture over surfaces: sRGB (IEC 61966-2-1), 8 bits.
struct Texture {
  /// What lies beyond 0..1 along an axis.
  enum class Wrap : std::uint8_t { repeat, mirror, clamp };
  int width = 1, height = 1;
  std::vector<std::uint8_t> rgb;  ///< rows downwards
  Wrap across = Wrap::repeat, down = Wrap::repeat;

  /// Linear light, 0..1, bilinear between texels' middles; (0, 0) is the upper left corner.
  [[nodiscard]] std::array<float, 3> at(float u, float v) const;
};

}  // namespace emberlock::apply
