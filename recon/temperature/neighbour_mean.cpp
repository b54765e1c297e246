// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/neighbour_mean.h"

namespace emberlock::recon {
namespace {

/// The mean over a point and its neighbours along one axis; what lies outside counts as 0.
void mean_of_three(std::vector<float>& values, std::size_t each, const Grid& grid, int axis, Pool& pool) {
  const int n[3] = {grid.nx, grid.ny, grid.nz};
  const std::size_t step[3] = {each, each * static_cast<std::size_t>(grid.nx),
                               each * static_cast<std::size_t>(grid.nx) * static_cast<std::size_t>(grid.ny)};
  const int a = axis == 0 ? 1 : 0;
  const int b = axis == 2 ? 1 : 2;
  pool.run(n[b], [&](int j) {
    for (int i = 0; i < n[a]; ++i)
      for (std::size_t c = 0; c < each; ++c) {
        float* line =
            values.data() + static_cast<std::size_t>(i) * step[a] + static_cast<std::size_t>(j) * step[b] + c;
        float before = 0;
        for (int k = 0; k < n[axis]; ++k, line += step[axis]) {
          const float own = *line;
          const float after = k + 1 < n[axis] ? line[step[axis]] : 0;
          *line = (before + own + after) / 3;
          before = own;
        }
      }
  });
}

}  // namespace

void take_neighbour_mean(std::vector<float>& values, std::size_t each, const Grid& grid, Pool& pool) {
  for (int axis = 0; axis < 3; ++axis) mean_of_three(values, each, grid, axis, pool);
}

}  // namespace emberlock::recon
