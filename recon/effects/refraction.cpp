// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/refraction.h"

#include <algorithm>
#include <cmath>

namespace emberlock::recon {
namespace {

constexpr int kCells = 32;     // along the medium's longest side, at most
constexpr int kSmoothing = 2;  // passes of (1 2 1) / 4 along each axis
// Cells around the medium: each smoothing pass and the distribution of voxels to key points need one, and the
// gradient on the surface needs two layers with the surroundings' temperature.
constexpr int kMargin = kSmoothing + 3;

Grid coarse_grid(const Grid& fine) {
  const int longest = std::max({fine.nx, fine.ny, fine.nz}) - 1;
  const int cell = std::max(1, (longest + kCells - 1) / kCells);
  Grid coarse = fine;
  coarse.edge = fine.edge * static_cast<float>(cell);
  for (float& o : coarse.origin) o -= static_cast<float>(kMargin) * coarse.edge;
  const auto key_points = [&](int n) { return (n - 1 + cell - 1) / cell + 1 + 2 * kMargin; };
  coarse.nx = key_points(fine.nx);
  coarse.ny = key_points(fine.ny);
  coarse.nz = key_points(fine.nz);
  return coarse;
}

/// Luminance of each voxel of the medium divided by the mean, at most 1; 1 without emission.
std::vector<float> heat(const Hull& medium, const std::vector<Rgba>& emission) {
  std::vector<float> out(medium.inside.begin(), medium.inside.end());
  if (emission.empty()) return out;
  const Grid& g = medium.grid;
  double sum = 0;
  std::size_t at = 0;
  for (int k = 0; k < g.nz - 1; ++k) {
    for (int j = 0; j < g.ny - 1; ++j) {
      for (int i = 0; i < g.nx - 1; ++i, ++at) {
        if (medium.inside[at] == 0) continue;
        Rgba mean;
        for (int c = 0; c < 8; ++c)
          mean = mean + 0.125F * emission[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))];
        out[at] = mean.c[0] + mean.c[1] + mean.c[2];
        sum += static_cast<double>(out[at]);
      }
    }
  }
  const auto mean = static_cast<float>(sum / static_cast<double>(std::max<std::size_t>(1, medium.count)));
  for (float& v : out) v = mean > 0 ? std::clamp(v / mean, 0.F, 1.F) : 0;
  return out;
}

/// Distributes every voxel's value to the eight coarse key points around its middle, so that a medium of ones
/// gives ones.
std::vector<float> spread(const std::vector<float>& voxels, const Grid& fine, const Grid& coarse) {
  std::vector<float> out(coarse.size());
  const float ratio = fine.edge / coarse.edge;
  const float whole = ratio * ratio * ratio;
  std::size_t at = 0;
  for (int k = 0; k < fine.nz - 1; ++k) {
    for (int j = 0; j < fine.ny - 1; ++j) {
      for (int i = 0; i < fine.nx - 1; ++i, ++at) {
        if (voxels[at] == 0) continue;
        const int voxel[3] = {i, j, k};
        int cell[3];
        float share[3];
        for (int a = 0; a < 3; ++a) {
          const float p = static_cast<float>(kMargin) + ratio * (static_cast<float>(voxel[a]) + 0.5F);
          cell[a] = static_cast<int>(p);
          share[a] = p - static_cast<float>(cell[a]);
        }
        for (int c = 0; c < 8; ++c) {
          float weight = whole;
          for (int a = 0; a < 3; ++a) weight *= (c >> a & 1) != 0 ? share[a] : 1 - share[a];
          out[coarse.index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2))] +=
              weight * voxels[at];
        }
      }
    }
  }
  return out;
}

void smooth(std::vector<float>& values, const Grid& g) {
  const std::size_t stride[3] = {1, g.index(0, 1, 0), g.index(0, 0, 1)};
  for (const std::size_t s : stride) {
    const std::vector<float> in = values;  // indices that wrap around are in the margin, where values are 0
    for (std::size_t p = s; p + s < values.size(); ++p)
      values[p] = 0.25F * in[p - s] + 0.5F * in[p] + 0.25F * in[p + s];
  }
}

float relative_excess(float kelvin, Kelvin ambient) {
  const double outside = index_excess(ambient);
  return static_cast<float>((index_excess(Kelvin(static_cast<double>(kelvin))) - outside) / (1 + outside));
}

std::vector<float> excess_of(const GasTemperature& gas, Kelvin ambient) {
  std::vector<float> out(gas.kelvin.size());
  std::transform(gas.kelvin.begin(), gas.kelvin.end(), out.begin(),
                 [&](float kelvin) { return relative_excess(kelvin, ambient); });
  return out;
}

}  // namespace

double index_excess(Kelvin temperature) {
  constexpr double kAir = 2.7e-4;
  constexpr Kelvin kAirTemperature(293);
  return kAir * (kAirTemperature / temperature);
}

GasTemperature assume_temperature(const Hull& medium, const std::vector<Rgba>& emission,
                                  const Refraction& refraction) {
  GasTemperature gas{coarse_grid(medium.grid), {}};
  gas.kelvin = spread(heat(medium, emission), medium.grid, gas.grid);
  for (int pass = 0; pass < kSmoothing; ++pass) smooth(gas.kelvin, gas.grid);
  const auto ambient = static_cast<float>(refraction.ambient.value());
  const auto rise = static_cast<float>((refraction.flame - refraction.ambient).value());
  for (float& v : gas.kelvin) v = ambient + rise * v;
  return gas;
}

RefractiveIndex::RefractiveIndex(const GasTemperature& gas, Kelvin ambient)
    : RefractiveIndex(gas.grid, excess_of(gas, ambient)) {}

RefractiveIndex::RefractiveIndex(const Grid& grid, const std::vector<float>& excess)
    : grid_(grid), values_(grid.size()) {
  const int size[3] = {grid.nx, grid.ny, grid.nz};
  const std::size_t stride[3] = {1, grid.index(0, 1, 0), grid.index(0, 0, 1)};
  for (int k = 0; k < grid.nz; ++k) {
    for (int j = 0; j < grid.ny; ++j) {
      for (int i = 0; i < grid.nx; ++i) {
        const std::size_t p = grid.index(i, j, k);
        const int at[3] = {i, j, k};
        for (int a = 0; a < 3; ++a) {
          const int back = at[a] > 0 ? 1 : 0;
          const int ahead = at[a] < size[a] - 1 ? 1 : 0;
          const float change =
              excess[p + (ahead != 0 ? stride[a] : 0)] - excess[p - (back != 0 ? stride[a] : 0)];
          values_[p].c[a] = change / static_cast<float>(back + ahead);
        }
        values_[p].c[3] = excess[p];
      }
    }
  }
}

IndexField RefractiveIndex::field(const Grid& grid) const {
  IndexField out;
  for (int a = 0; a < 3; ++a) out.origin[a] = (grid_.origin[a] - grid.origin[a]) / grid.edge;
  out.edge = grid_.edge / grid.edge;
  out.nx = grid_.nx;
  out.ny = grid_.ny;
  out.nz = grid_.nz;
  out.values = values_.data();
  return out;
}

}  // namespace emberlock::recon
