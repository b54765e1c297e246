// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace emberlock::apply {

/// How a video's levels of 8 bits stand for light, and back: by sRGB (IEC 61966-2-1), or in proportion. A
/// level that is developed and turned back is the same.
class Transfer {
 public:
  enum class Curve { srgb, linear };
  explicit Transfer(Curve curve);

  /// Linear grey levels, 0..255.
  [[nodiscard]] float light(std::uint8_t level) const { return light_[level]; }
  [[nodiscard]] const std::array<float, 256>& lights() const { return light_; }
  /// Of linear grey levels; darker and brighter ones are 0 and 255.
  [[nodiscard]] std::uint8_t level(float light) const {
    if (!(light > 0)) return 0;
    if (light >= 255) return 255;
    return level_[static_cast<std::size_t>(light * kSteps)];
  }

 private:
  static constexpr float kSteps = 256;  ///< a grey level
  std::array<float, 256> light_ = {};
  std::vector<std::uint8_t> level_;
};

}  // namespace emberlock::apply
