// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/exposure.h"

#include <algorithm>
#include <cmath>

#include "recon/effects/exposure_cuda.h"
#include "recon/kernels/exposure.h"

namespace emberlock::recon {
namespace {

/// The spread of the instants for a motion by `way` edges. Linear interpolation between key points blurs too,
/// by the mean of f (1 - f). So the spread is smaller than the motion, such that the mean square displacement
/// equals that of the motion, way^2 / 12. For a spread up to 2 it is spread / 4, above that spread^2 / 12 + 1
/// / 6.
double spread_of(double way) { return way * way <= 6 ? way * way / 3 : std::sqrt(way * way - 2); }

std::vector<float> shift_weights(double way) {
  if (way <= 0.5) return {1};
  const double spread = spread_of(way);
  const int instants = 16 * static_cast<int>(std::ceil(way));
  const int reach = static_cast<int>(std::ceil(spread / 2));
  std::vector<double> sum(2 * static_cast<std::size_t>(reach) + 1);
  for (int i = 0; i < instants; ++i) {
    const double shift = spread * ((i + 0.5) / instants - 0.5) + reach;
    const auto below = static_cast<std::size_t>(shift);
    const double share = shift - std::floor(shift);
    sum[below] += (1 - share) / instants;
    sum[below + 1] += share / instants;
  }
  std::vector<float> weights(sum.size());
  std::transform(sum.begin(), sum.end(), weights.begin(), [](double w) { return static_cast<float>(w); });
  return weights;
}

}  // namespace

ExposureBlur::ExposureBlur(const Exposure& exposure, const Grid& grid) : grid_(grid), weights_{1} {
  if (exposure.shutter == Exposure::Shutter::integrated)
    weights_ =
        shift_weights(std::abs(exposure.rise_speed) * exposure.time.value() / static_cast<double>(grid.edge));
}

std::vector<Rgba> ExposureBlur::forward(const std::vector<Rgba>& x, Pool& pool) const {
  return average(x, 1, pool);
}

std::vector<Rgba> ExposureBlur::adjoint(const std::vector<Rgba>& y, Pool& pool) const {
  return average(y, -1, pool);
}

std::vector<Rgba> ExposureBlur::average(const std::vector<Rgba>& in, int direction, Pool& pool) const {
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda) return average_on_cuda(in, grid_, weights_, direction);
  }
  std::vector<Rgba> out(in.size());
  const std::size_t plane = grid_.index(0, 0, 1);
  const AverageAlongZ<float> column{in.data(), out.data(),      plane,
                                    grid_.nz,  weights_.data(), static_cast<int>(weights_.size() / 2),
                                    direction};
  pool.run(grid_.nz, [&](int k) {
    for (std::size_t p = 0; p < plane; ++p) column(p, k);
  });
  return out;
}

}  // namespace emberlock::recon
