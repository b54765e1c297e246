// SPDX-License-Identifier: Apache-2.0
#include "recon/render/lit_medium.h"

#include <algorithm>

#include <Eigen/Core>

#include "recon/kernels/in_scatter.h"

namespace emberlock::recon {
namespace {

constexpr int kMostPlaces = 48;  // between the places at which light is computed, along the longest side

/// Every n-th key point along one axis, and the last one.
std::vector<int> places_along(int points, int every) {
  std::vector<int> places;
  for (int i = 0; i < points - 1; i += every) places.push_back(i);
  places.push_back(points - 1);
  return places;
}

/// Where a key point lies between two of the places.
struct Between {
  std::size_t low = 0, high = 0;
  float part = 0;
};
Between between(const std::vector<int>& places, int i, int every) {
  const auto last = places.size() - 1;
  const auto low = std::min(static_cast<std::size_t>(i / every), last);
  const std::size_t high = std::min(low + 1, last);
  const int way = places[high] - places[low];
  return {low, high, way > 0 ? static_cast<float>(i - places[low]) / static_cast<float>(way) : 0.F};
}

class Reach {
 public:
  Reach(const std::vector<Rgba>& dark, const Grid& grid, const Light& light)
      : grid_(grid), light_(light), arriving_{{grid.nx, grid.ny, grid.nz, dark.data()}} {}

  float operator()(int i, int j, int k) const {
    const float place[3] = {static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
    Eigen::Vector3d to(light_.place[0], light_.place[1], light_.place[2]);
    double spread = 1;
    if (light_.source == Light::Source::nearby) {
      for (int a = 0; a < 3; ++a)
        to[a] -= static_cast<double>(grid_.origin[a]) + static_cast<double>(grid_.edge * place[a]);
      // A light at the very place would be infinitely bright there.
      spread = std::max(to.squaredNorm(), static_cast<double>(grid_.edge * grid_.edge));
    }
    const Eigen::Vector3f travel = -to.normalized().cast<float>();
    const float lost = arriving_(place, grid_.index(i, j, k), travel.data()).c[3];
    return static_cast<float>(static_cast<double>(1 - lost) / spread);
  }

 private:
  const Grid& grid_;
  const Light& light_;
  ArrivingRadiance arriving_;
};

}  // namespace

std::vector<float> light_that_reaches(const std::vector<Rgba>& medium, const Grid& grid, const Light& light,
                                      Pool& pool) {
  if (light.source != Light::Source::distant && light.source != Light::Source::nearby)
    return std::vector<float>(grid.size(), 1.F);
  std::vector<Rgba> dark(grid.size());
  for (std::size_t p = 0; p < dark.size(); ++p) dark[p].c[3] = medium[p].c[3];
  const int every = std::max(1, (std::max({grid.nx, grid.ny, grid.nz}) - 1 + kMostPlaces - 1) / kMostPlaces);
  const std::vector<int> xs = places_along(grid.nx, every);
  const std::vector<int> ys = places_along(grid.ny, every);
  const std::vector<int> zs = places_along(grid.nz, every);
  const Reach reach(dark, grid, light);
  std::vector<float> at(xs.size() * ys.size() * zs.size());
  pool.run(static_cast<int>(zs.size()), [&](int k) {
    float* to = &at[xs.size() * ys.size() * static_cast<std::size_t>(k)];
    for (const int y : ys)
      for (const int x : xs) *to++ = reach(x, y, zs[static_cast<std::size_t>(k)]);
  });
  if (every == 1) return at;
  std::vector<float> out(grid.size());
  pool.run(grid.nz, [&](int k) {
    const Between z = between(zs, k, every);
    for (int j = 0; j < grid.ny; ++j) {
      const Between y = between(ys, j, every);
      for (int i = 0; i < grid.nx; ++i) {
        const Between x = between(xs, i, every);
        const auto along = [&](std::size_t b, std::size_t c) {
          const float* row = &at[xs.size() * (b + ys.size() * c)];
          return row[x.low] + x.part * (row[x.high] - row[x.low]);
        };
        const float low = along(y.low, z.low) + y.part * (along(y.high, z.low) - along(y.low, z.low));
        const float high = along(y.low, z.high) + y.part * (along(y.high, z.high) - along(y.low, z.high));
        out[grid.index(i, j, k)] = low + z.part * (high - low);
      }
    }
  });
  return out;
}

std::vector<float> lit_emission(const Volume& volume, const Light& light, Pool& pool) {
  std::vector<Rgba> medium(volume.extinction.size());
  for (std::size_t p = 0; p < medium.size(); ++p) medium[p].c[3] = volume.grid.edge * volume.extinction[p];
  const std::vector<float> reach = light_that_reaches(medium, volume.grid, light, pool);
  std::vector<float> source(3 * medium.size());
  for (std::size_t p = 0; p < medium.size(); ++p)
    for (std::size_t c = 0; c < 3; ++c)
      source[3 * p + c] =
          volume.extinction[p] *
          static_cast<float>(light.ambient[c] + light.strength[c] * static_cast<double>(reach[p]));
  return source;
}

}  // namespace emberlock::recon
