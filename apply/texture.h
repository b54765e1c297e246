// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "apply/kernels/surface.h"

namespace emberlock::apply {

/// A picture over surfaces: sRGB (IEC 61966-2-1), 8 bits; read by SurfaceTable.
struct Texture {
  int width = 1, height = 1;
  std::vector<std::uint8_t> rgb;  ///< rows downwards
  Wrap across = Wrap::repeat, down = Wrap::repeat;
};

/// The linear light of each level of sRGB, 0..1.
const std::array<float, 256>& linear_levels();

}  // namespace emberlock::apply
