// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/model_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>

namespace emberlock::recon {

Reconstruction blended(const Reconstruction& done) {
  const Grid& g = done.volume.grid;
  Reconstruction out = done;
  std::vector<std::uint8_t> glows(g.size());
  for (std::size_t i = 0; i < done.volume.emission.size(); ++i)
    if (done.volume.emission[i] > 0) glows[i / 3] = 1;
  const auto blend = [&](const std::vector<float>& from, std::vector<float>& to, std::size_t channels) {
    for (int k = 0; k < g.nz; ++k)
      for (int j = 0; j < g.ny; ++j)
        for (int i = 0; i < g.nx; ++i) {
          const std::size_t middle = g.index(i, j, k);
          if (glows[middle] == 0) continue;
          std::array<float, 3> sum = {};
          float weights = 0;
          for (int n = 0; n < 27; ++n) {
            const int x = i + n % 3 - 1;
            const int y = j + n / 3 % 3 - 1;
            const int z = k + n / 9 - 1;
            if (x < 0 || y < 0 || z < 0 || x >= g.nx || y >= g.ny || z >= g.nz) continue;
            const std::size_t p = g.index(x, y, z);
            if (glows[p] == 0) continue;
            const float weight = std::ldexp(1.0F, -std::abs(x - i) - std::abs(y - j) - std::abs(z - k));
            for (std::size_t c = 0; c < channels; ++c) sum[c] += weight * from[channels * p + c];
            weights += weight;
          }
          for (std::size_t c = 0; c < channels; ++c) to[channels * middle + c] = sum[c] / weights;
        }
  };
  blend(done.volume.emission, out.volume.emission, 3);
  if (!done.volume.extinction.empty()) blend(done.volume.extinction, out.volume.extinction, 1);
  return out;
}

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
