// SPDX-License-Identifier: Apache-2.0
#include "apply/texture.h"

#include <cmath>

namespace emberlock::apply {

const std::array<float, 256>& linear_levels() {
  static const std::array<float, 256> levels = [] {
    std::array<float, 256> all{};
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double level = static_cast<double>(i) / 255;
      all[i] = static_cast<float>(level <= 0.04045 ? level / 12.92 : std::pow((level + 0.055) / 1.055, 2.4));
    }
    return all;
  }();
  return levels;
}

}  // namespace emberlock::apply
