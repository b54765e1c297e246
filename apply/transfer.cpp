// SPDX-License-Identifier: Apache-2.0
#include "apply/transfer.h"

#include <algorithm>
#include <cmath>

namespace emberlock::apply {

Transfer::Transfer(Curve curve) {
  const auto light_of = [&](double level) {
    const double v = level / 255;
    if (curve == Curve::linear) return level;
    return 255 * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  };
  for (std::size_t i = 0; i < light_.size(); ++i)
    light_[i] = static_cast<float>(light_of(static_cast<double>(i)));
  const auto steps = static_cast<std::size_t>(255 * kSteps);
  level_.resize(steps);
  std::size_t level = 0;
  for (std::size_t s = 0; s < steps; ++s) {
    const double middle = (static_cast<double>(s) + 0.5) / static_cast<double>(kSteps);
    while (level < 255 && light_of(static_cast<double>(level) + 0.5) <= middle) ++level;
    level_[s] = static_cast<std::uint8_t>(level);
  }
}

}  // namespace emberlock::apply
