// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/model_errors.h"

#include <algorithm>
#include <cmath>

namespace emberlock::recon {

Dispersion::Dispersion(const Thermometer& meter, const CameraResponse& response) {
  constexpr int kColdest = 700, kHottest = 3500, kStep = 100;  // K
  for (int kelvin = kColdest; kelvin <= kHottest; kelvin += kStep) {
    const EmitterLevels levels = levels_of_constant_soot(response, Kelvin(kelvin));
    const Eigen::Vector3d level = Eigen::Vector3d::Map(levels.value.data());
    const Reading reading = meter.read(glow_of(level, Eigen::Vector3d::Constant(1e-3)));
    if (reading.told != Reading::Told::yes || (!read_.empty() && reading.kelvin <= read_.back())) continue;
    read_.push_back(reading.kelvin);
    too_hot_.push_back(reading.kelvin - kelvin);
  }
}

double Dispersion::at(double kelvin) const {
  if (read_.empty()) return 0;
  const auto above = std::lower_bound(read_.begin(), read_.end(), kelvin) - read_.begin();
  const std::size_t high = std::min(static_cast<std::size_t>(above), read_.size() - 1);
  const std::size_t low = high > 0 ? high - 1 : high;
  const double span = read_[high] - read_[low];
  const double part = span > 0 ? std::clamp((kelvin - read_[low]) / span, 0.0, 1.0) : 0;
  return (1 - part) * too_hot_[low] + part * too_hot_[high];
}

}  // namespace emberlock::recon
