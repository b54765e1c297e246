// SPDX-License-Identifier: Apache-2.0
#include "recon/render/sunlight.h"

#include <numbers>

#include "recon/kernels/in_scatter.h"

namespace emberlock::recon {

std::vector<float> scattered_sunlight(const Volume& volume, const Sunlight& sun, double albedo, Pool& pool) {
  const Grid& g = volume.grid;
  std::vector<Rgba> dark(g.size());
  for (std::size_t p = 0; p < g.size(); ++p) dark[p].c[3] = g.edge * volume.extinction[p];
  const ArrivingRadiance arriving{{g.nx, g.ny, g.nz, dark.data()}};
  const Eigen::Vector3f travel = -sun.towards.cast<float>();
  const double share = albedo / (4 * std::numbers::pi);
  std::vector<float> source(3 * g.size());
  const std::size_t plane = static_cast<std::size_t>(g.nx) * static_cast<std::size_t>(g.ny);
  pool.run(g.nz, [&](int k) {
    const std::size_t first = plane * static_cast<std::size_t>(k);
    for (std::size_t p = first; p < first + plane; ++p) {
      if (!(volume.extinction[p] > 0)) continue;
      float place[3];
      key_point(g.nx, g.ny, p, place);
      const double lost = static_cast<double>(arriving(place, p, travel.data()).c[3]);
      const double strength = share * static_cast<double>(volume.extinction[p]) * (1 - lost);
      for (std::size_t c = 0; c < 3; ++c)
        source[3 * p + c] = static_cast<float>(strength * sun.irradiance[c]);
    }
  });
  return source;
}

}  // namespace emberlock::recon
