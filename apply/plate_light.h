// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "apply/flame.h"
#include "recon/compute/pool.h"

namespace emberlock::apply {

/// A flame's light on the plate z = 0 around the world's origin: its irradiance (surface_light.h), on a
/// square of points, without random numbers and so without noise. It is summed over the voxels of the flame's
/// coarse grid; a voxel that is nearer than four of its edges is taken as 4 x 4 x 4 places.
class PlateLight {
 public:
  PlateLight() = default;
  /// `edge`: of the square, metres. `points` along each side, >= 2.
  PlateLight(const Flame& flame, double edge, int points, recon::Pool& pool);

  /// Grey levels times steradian; between the points interpolated, and beyond the square nothing: it fades
  /// over its outer tenth, so that it has no visible end.
  [[nodiscard]] Eigen::Vector3f at(float x, float y) const;
  [[nodiscard]] double edge() const { return edge_; }

 private:
  double edge_ = 0;
  int points_ = 0;
  std::vector<Eigen::Vector3f> irradiance_;  ///< row by row, y upwards
};

}  // namespace emberlock::apply
