// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <type_traits>

#include <Eigen/Dense>

#include "base/random.h"
#include "recon/hull/hull.h"

namespace emberlock {

/// Calls act(i, j, k) or act(i, j, k, index) at each key point of a grid, in the order of memory.
template <class Act>
void each_point(const recon::Grid& grid, const Act& act) {
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i)
        if constexpr (std::is_invocable_v<Act, int, int, int>)
          act(i, j, k);
        else
          act(i, j, k, grid.index(i, j, k));
}

/// A grid whose key points stand for another one's voxels, as each_point() counts them.
inline recon::Grid voxels_of(recon::Grid grid) {
  --grid.nx, --grid.ny, --grid.nz;
  return grid;
}

/// Metres.
inline Eigen::Vector3d place_of(const recon::Grid& grid, int i, int j, int k) {
  return Eigen::Vector3f(grid.origin[0], grid.origin[1], grid.origin[2]).cast<double>() +
         static_cast<double>(grid.edge) * Eigen::Vector3d(i, j, k);
}

/// A cube around the origin.
inline recon::Grid cube_grid(double edge, int voxels) {
  return recon::grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(edge)}, voxels);
}

/// How much of the voxel around a key point lies in a ball around the origin, about.
inline double share_in_ball(const recon::Grid& grid, int i, int j, int k, double radius) {
  const double r = place_of(grid, i, j, k).norm();
  return std::clamp((radius - r) / static_cast<double>(grid.edge) + 0.5, 0.0, 1.0);
}

/// A medium of a share of the voxels, `together` of which are neighbours in memory.
inline recon::Hull medium_with_holes(const recon::Grid& grid, double share, std::size_t together = 1) {
  recon::Hull medium = recon::whole_grid(grid);
  medium.count = 0;
  for (std::size_t v = 0; v < medium.inside.size(); ++v) {
    medium.inside[v] = random_uniform(4, 0, v / together) < share ? 1 : 0;
    medium.count += medium.inside[v];
  }
  return medium;
}

}  // namespace emberlock
