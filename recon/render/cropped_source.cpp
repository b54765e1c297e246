// SPDX-License-Identifier: Apache-2.0
#include "recon/render/cropped_source.h"

namespace emberlock::recon {

std::vector<Rgba> cropped_source(const Volume& volume, const CroppedHull& crop,
                                 Extinction::Model extinction) {
  const Grid& c = crop.hull.grid;
  std::vector<Rgba> out(c.size());
  for (int k = 0; k < c.nz; ++k) {
    for (int j = 0; j < c.ny; ++j) {
      const std::size_t first = volume.grid.index(crop.offset[0], crop.offset[1] + j, crop.offset[2] + k);
      const float* from = &volume.emission[3 * first];
      Rgba* to = &out[c.index(0, j, k)];
      for (int i = 0; i < c.nx; ++i, from += 3) to[i] = c.edge * Rgba{{from[0], from[1], from[2], 0}};
      if (extinction == Extinction::Model::field)
        for (int i = 0; i < c.nx; ++i)
          to[i].c[3] = c.edge * volume.extinction[first + static_cast<std::size_t>(i)];
    }
  }
  return out;
}

}  // namespace emberlock::recon
