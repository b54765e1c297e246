// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <utility>
#include <vector>

#include "apply/flame.h"
#include "apply/gltf_file.h"
#include "base/random.h"
#include "recon/pipeline/shown_volume.h"

namespace emberlock::test {

/// A volume whose values are a function of the key point: emission in lanes 0..2, extinction in lane 3;
/// without extinction anywhere, it has none.
using Values = std::function<std::array<float, 4>(int i, int j, int k)>;
inline recon::Volume volume_of(const recon::Grid& grid, const Values& values) {
  recon::Volume volume;
  volume.grid = grid;
  volume.emission.resize(3 * grid.size());
  volume.extinction.resize(grid.size());
  bool absorbs = false;
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const std::size_t p = grid.index(i, j, k);
        const std::array<float, 4> v = values(i, j, k);
        for (std::size_t c = 0; c < 3; ++c) volume.emission[3 * p + c] = v[c];
        volume.extinction[p] = v[3];
        absorbs = absorbs || v[3] > 0;
      }
  if (!absorbs) volume.extinction.clear();
  return volume;
}

/// Key points whose values have nothing to do with each other: 0..most of each.
inline Values uneven(std::uint64_t seed, double light, double extinction) {
  return [=](int i, int j, int k) {
    const std::uint64_t stream = static_cast<std::uint64_t>(i + 1000 * (j + 1000 * k));
    const auto value = [&](std::uint64_t c, double most) {
      return static_cast<float>(most * random_uniform(seed, stream, c));
    };
    return std::array<float, 4>{value(0, light), value(1, light), value(2, light), value(3, extinction)};
  };
}

/// Light of one key point in the middle of 2 x 2 x 2 voxels of a centimetre around the origin: its integral
/// over the volume is 1e-6 m3 times its source.
inline recon::Volume spark(float source) {
  return volume_of({{-0.01F, -0.01F, -0.01F}, 0.01F, 3, 3, 3}, [=](int i, int j, int k) {
    const float s = i == 1 && j == 1 && k == 1 ? source : 0;
    return std::array<float, 4>{s, s / 2, s / 4, 0};
  });
}

inline apply::Placement moved(double x, double y, double z) {
  apply::Placement place;
  place.translation = {x, y, z};
  return place;
}

/// Adds a horizontal square around (x, y) at a height.
inline void add_square(apply::Mesh& mesh, double x, double y, double height, double half,
                       const apply::Material& material = {}) {
  const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
  for (const auto& [sx, sy] : {std::pair(-1, -1), {1, -1}, {1, 1}, {-1, 1}})
    mesh.vertices.push_back(
        {static_cast<float>(x + sx * half), static_cast<float>(y + sy * half), static_cast<float>(height)});
  mesh.triangles.push_back({first, first + 1, first + 2});
  mesh.triangles.push_back({first, first + 2, first + 3});
  mesh.material.insert(mesh.material.end(), 2, static_cast<std::uint32_t>(mesh.materials.size()));
  mesh.materials.push_back(material);
}

}  // namespace emberlock::test
