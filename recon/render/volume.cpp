// SPDX-License-Identifier: Apache-2.0
#include "recon/render/volume.h"

namespace emberlock::recon {

std::vector<float> shares_inside(const Volume& volume) {
  if (volume.inside.empty()) return {};
  const Grid& g = volume.grid;
  std::vector<float> share(g.size());
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i)
        if (volume.inside[voxel++] != 0)
          for (int c = 0; c < 8; ++c) share[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] += 0.125F;
  return share;
}

}  // namespace emberlock::recon
