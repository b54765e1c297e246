// SPDX-License-Identifier: Apache-2.0
#include "recon/render/at_key_points.h"

#include <algorithm>

namespace emberlock::recon {
namespace {

constexpr float kRounding = 1e-3F;  // of places, edges

}  // namespace

std::vector<float> at_key_points(const Grid& grid, const Grid& from, const std::vector<float>& values,
                                 std::size_t lanes) {
  std::vector<float> out(lanes * grid.size());
  const int n[3] = {from.nx, from.ny, from.nz};
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const int at[3] = {i, j, k};
        int low[3];
        float part[3];
        bool inside = true;
        for (int d = 0; d < 3; ++d) {
          float x = (grid.origin[d] + grid.edge * static_cast<float>(at[d]) - from.origin[d]) / from.edge;
          const auto last = static_cast<float>(n[d] - 1);
          inside = inside && x >= -kRounding && x <= last + kRounding;
          x = std::clamp(x, 0.F, last);
          low[d] = inside ? std::min(static_cast<int>(x), n[d] - 2) : 0;
          part[d] = x - static_cast<float>(low[d]);
        }
        if (!inside) continue;
        float* to = &out[lanes * grid.index(i, j, k)];
        for (int corner = 0; corner < 8; ++corner) {
          float weight = 1;
          for (int d = 0; d < 3; ++d) weight *= (corner >> d & 1) != 0 ? part[d] : 1 - part[d];
          const float* value = &values[lanes * from.index(low[0] + (corner & 1), low[1] + (corner >> 1 & 1),
                                                          low[2] + (corner >> 2))];
          for (std::size_t lane = 0; lane < lanes; ++lane) to[lane] += weight * value[lane];
        }
      }
  return out;
}

}  // namespace emberlock::recon
