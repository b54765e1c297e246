// SPDX-License-Identifier: Apache-2.0
#include "recon/render/scattered_source.h"

#include <algorithm>

namespace emberlock::recon {

void add_in_scatter(const ScatterField& field, const Eigen::Vector3d& camera_center, const Grid& grid,
                    const Extinction& extinction, Pool& pool, std::vector<Rgba>& source) {
  const std::vector<Rgba> g = in_scattered(field, camera_center, pool);
  const Grid& coarse_grid = field.medium.grid;
  const ShiningGrid coarse{coarse_grid.nx, coarse_grid.ny, coarse_grid.nz, g.data()};
  const bool varies = extinction.model == Extinction::Model::field;
  const auto albedo = static_cast<float>(field.albedo);
  const auto sigma = static_cast<float>(extinction.value.value() * static_cast<double>(grid.edge));
  const float scale = grid.edge / coarse_grid.edge;
  float shift[3];
  for (int a = 0; a < 3; ++a) shift[a] = (grid.origin[a] - coarse_grid.origin[a]) / coarse_grid.edge;
  pool.run(grid.nz, [&](int k) {
    const float z = shift[2] + scale * static_cast<float>(k);
    for (int j = 0; j < grid.ny; ++j) {
      const float y = shift[1] + scale * static_cast<float>(j);
      Rgba* row = &source[grid.index(0, j, k)];
      for (int i = 0; i < grid.nx; ++i) {
        const float sigma_s = albedo * (varies ? row[i].c[3] : sigma);
        row[i] = row[i] + sigma_s * coarse.at(shift[0] + scale * static_cast<float>(i), y, z);
      }
    }
  });
}

void take_out_in_scatter(Volume& volume, const Hull& medium, const Effects& effects, Pool& pool) {
  Effects once = effects;  // light from the whole source, directly to the place of scattering
  once.scattering.order = Scattering::Order::single;
  once.scattering.asymmetry = 0;
  const bool scattered_again = effects.scattering.order == Scattering::Order::multiple;
  const std::vector<float> seen = volume.emission;
  Volume source = volume;  // the light that is scattered
  const float per_meter = 1 / volume.grid.edge;
  constexpr int kRounds = 6;  // each finds more of the light from places where less is emitted than assumed
  for (int round = 0; round < kRounds; ++round) {
    const ScatterField field = find_in_scatter(source, medium, once, {}, pool);
    if (field.empty()) return;
    std::vector<Rgba> scattered(volume.grid.size());
    if (effects.extinction.model == Extinction::Model::field)
      for (std::size_t p = 0; p < scattered.size(); ++p)
        scattered[p].c[3] = volume.grid.edge * volume.extinction[p];
    add_in_scatter(field, Eigen::Vector3d::Zero(), volume.grid, effects.extinction, pool, scattered);
    for (std::size_t p = 0; p < scattered.size(); ++p) {
      for (std::size_t c = 0; c < 3; ++c) {
        // Beyond the medium's box G is extrapolated, to negative values too.
        const float in = std::max(0.F, per_meter * scattered[p].c[c]);
        const float out = std::max(0.F, seen[3 * p + c] - in);
        volume.emission[3 * p + c] = out;
        source.emission[3 * p + c] = scattered_again ? out + in : out;
      }
    }
  }
}

}  // namespace emberlock::recon
