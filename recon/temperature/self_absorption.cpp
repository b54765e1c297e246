// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/self_absorption.h"

#include <algorithm>
#include <cmath>

#include "recon/compute/pool.h"
#include "recon/kernels/planck.h"

namespace emberlock::recon {
namespace {

constexpr double kGlow = 1800;  // K: a channel's mean absorption hardly depends on it
constexpr int kCoarser = 4;
constexpr double kEven = 1e-3;  // channels that differ by less are alike

/// Trilinear, 0 outside.
class Extinctions {
 public:
  explicit Extinctions(const Volume& volume) : grid_(volume.grid), value_(volume.extinction) {}
  [[nodiscard]] double at(const Eigen::Vector3d& place) const {
    std::array<int, 3> low = {};
    std::array<double, 3> part = {};
    const std::array<int, 3> n = {grid_.nx, grid_.ny, grid_.nz};
    for (std::size_t d = 0; d < 3; ++d) {
      const double x = (place[static_cast<Eigen::Index>(d)] - static_cast<double>(grid_.origin[d])) /
                       static_cast<double>(grid_.edge);
      if (!(x >= 0 && x < n[d] - 1)) return 0;
      low[d] = static_cast<int>(x);
      part[d] = x - low[d];
    }
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const int i = corner & 1;
      const int j = (corner >> 1) & 1;
      const int k = corner >> 2;
      const double weight = (i != 0 ? part[0] : 1 - part[0]) * (j != 0 ? part[1] : 1 - part[1]) *
                            (k != 0 ? part[2] : 1 - part[2]);
      sum += weight * static_cast<double>(value_[grid_.index(low[0] + i, low[1] + j, low[2] + k)]);
    }
    return sum;
  }
  /// Optical depth from a point towards another, up to the grid's end.
  [[nodiscard]] double depth(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    const double step = 2 * static_cast<double>(grid_.edge);
    const Eigen::Vector3d along = (to - from).normalized() * step;
    const double most = std::min(
        (to - from).norm(), 1.8 * static_cast<double>(grid_.edge) * std::max({grid_.nx, grid_.ny, grid_.nz}));
    double sum = 0;
    Eigen::Vector3d place = from + along / 2;
    for (double way = step / 2; way < most; way += step, place += along) sum += at(place) * step;
    return sum;
  }

 private:
  const Grid& grid_;
  const std::vector<float>& value_;
};

Grid coarser(const Grid& grid) {
  const auto points = [](int n) { return (n - 1 + kCoarser - 1) / kCoarser + 1; };
  Grid out = grid;
  out.edge *= kCoarser;
  out.nx = points(grid.nx);
  out.ny = points(grid.ny);
  out.nz = points(grid.nz);
  return out;
}

Eigen::Vector3d place_of(const Grid& grid, int i, int j, int k) {
  return Eigen::Vector3d(grid.origin[0], grid.origin[1], grid.origin[2]) +
         static_cast<double>(grid.edge) * Eigen::Vector3d(i, j, k);
}

/// The factors of one place.
std::array<float, 3> factors_at(const Extinctions& extinction, const std::vector<Eigen::Vector3d>& cameras,
                                const Eigen::Vector3d& place, const std::array<double, 3>& channel) {
  double all = 0;
  std::array<double, 3> own = {};
  for (const Eigen::Vector3d& camera : cameras) {
    const double depth = extinction.depth(place, camera);
    all += std::exp(-2 * depth);
    for (std::size_t c = 0; c < 3; ++c) own[c] += std::exp(-(1 + channel[c]) * depth);
  }
  std::array<float, 3> out = {1, 1, 1};
  for (std::size_t c = 0; c < 3; ++c)
    if (own[c] > 0) out[c] = static_cast<float>(std::clamp(all / own[c], 0.1, 10.0));
  return out;
}

/// From the coarse key points to the fine ones.
std::vector<float> refined(const Grid& coarse, const std::vector<std::array<float, 3>>& from,
                           const Grid& grid, Pool& pool) {
  std::vector<float> out(3 * grid.size());
  pool.run(grid.nz, [&](int k) {
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i)
        for (int corner = 0; corner < 8; ++corner) {
          const int at[3] = {i, j, k};
          int near[3];
          float weight = 1;
          for (int d = 0; d < 3; ++d) {
            const float part = static_cast<float>(at[d] % kCoarser) / kCoarser;
            const bool upper = ((corner >> d) & 1) != 0;
            near[d] = at[d] / kCoarser + (upper ? 1 : 0);
            weight *= upper ? part : 1 - part;
          }
          if (weight == 0) continue;
          const std::array<float, 3>& value = from[coarse.index(near[0], near[1], near[2])];
          for (std::size_t c = 0; c < 3; ++c) out[3 * grid.index(i, j, k) + c] += weight * value[c];
        }
  });
  return out;
}

}  // namespace

std::array<double, 3> channel_absorption(const CameraResponse& response, Emitter emitter,
                                         Kelvin temperature) {
  std::array<double, 3> out = {1, 1, 1};
  const double reference = log_planck(600, temperature.value());
  const auto light = [&](double nm) { return std::exp(log_planck(nm, temperature.value()) - reference); };
  for (std::size_t c = 0; c < 3; ++c) {
    const double all = integral(response, c, light);
    const double absorbed =
        integral(response, c, [&](double nm) { return relative_absorption(emitter, nm) * light(nm); });
    if (all > 0 && absorbed > 0) out[c] = absorbed / all;
  }
  return out;
}

SelfAbsorption self_absorption(const Scene& scene, const Reconstruction& done, const CameraResponse& response,
                               Emitter emitter, const ComputeOptions& compute) {
  SelfAbsorption out;
  const Volume& volume = done.volume;
  const std::array<double, 3> absorption = channel_absorption(response, emitter, Kelvin(kGlow));
  std::array<double, 3> light = {};
  for (std::size_t i = 0; i < volume.emission.size(); ++i)
    light[i % 3] += std::pow(static_cast<double>(volume.emission[i]), 2);
  const double all = light[0] + light[1] + light[2];
  if (!(all > 0)) return out;
  out.reference = (absorption[0] * light[0] + absorption[1] * light[1] + absorption[2] * light[2]) / all;
  double most = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    out.channel[c] = absorption[c] / out.reference;
    most = std::max(most, std::abs(out.channel[c] - 1));
  }
  if (volume.extinction.empty() || most < kEven) return out;
  std::vector<Eigen::Vector3d> cameras;
  for (const View& view : scene.views)
    if (view.role == ViewRole::input) cameras.push_back(view.camera.center());
  const Extinctions extinction(volume);
  const Grid coarse = coarser(volume.grid);
  std::vector<std::array<float, 3>> factors(coarse.size());
  Pool pool(compute.threads);
  pool.run(coarse.nz, [&](int k) {
    for (int j = 0; j < coarse.ny; ++j)
      for (int i = 0; i < coarse.nx; ++i)
        factors[coarse.index(i, j, k)] =
            factors_at(extinction, cameras, place_of(coarse, i, j, k), out.channel);
  });
  out.factor = refined(coarse, factors, volume.grid, pool);
  return out;
}

}  // namespace emberlock::recon
