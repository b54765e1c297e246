// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include <Eigen/Dense>

#include "recon/hull/hull.h"
#include "recon/render/render.h"
#include "recon/views/camera_model.h"

// The model of the march in double precision: tiny steps from the camera, no lists, no clipping.
namespace emberlock::recon {

/// Trilinear emission of one channel at a place; -1 outside the medium.
inline double emission_at(const Volume& volume, const Hull& medium, const Eigen::Vector3d& place,
                          int channel) {
  const Grid& g = volume.grid;
  const int size[3] = {g.nx - 1, g.ny - 1, g.nz - 1};
  int cell[3];
  double f[3];
  for (int a = 0; a < 3; ++a) {
    const double p = (place[a] - static_cast<double>(g.origin[a])) / static_cast<double>(g.edge);
    cell[a] = static_cast<int>(std::floor(p));
    if (cell[a] < 0 || cell[a] >= size[a]) return -1;
    f[a] = p - cell[a];
  }
  const int voxel = cell[0] + size[0] * (cell[1] + size[1] * cell[2]);
  if (medium.inside[static_cast<std::size_t>(voxel)] == 0) return -1;
  double sum = 0;
  for (int c = 0; c < 8; ++c) {
    const double w = (c & 1 ? f[0] : 1 - f[0]) * (c & 2 ? f[1] : 1 - f[1]) * (c & 4 ? f[2] : 1 - f[2]);
    const std::size_t at = g.index(cell[0] + (c & 1), cell[1] + (c >> 1 & 1), cell[2] + (c >> 2));
    sum += w * static_cast<double>(volume.emission[3 * at + static_cast<std::size_t>(channel)]);
  }
  return sum;
}

/// What a ray sees within `reach` metres, and how much of it lies in the medium.
struct BruteForce {
  double radiance = 0, length = 0;
};
inline BruteForce brute_force(const Volume& volume, const Hull& medium, double sigma, const Ray& ray,
                              int channel, double reach) {
  const double step = static_cast<double>(volume.grid.edge) / 200;
  BruteForce seen;
  for (double t = step / 2; t < reach; t += step) {
    const double s = emission_at(volume, medium, ray.origin + t * ray.direction, channel);
    if (s < 0) continue;
    seen.radiance += std::exp(-sigma * seen.length) * s * step;
    seen.length += step;
  }
  return seen;
}

}  // namespace emberlock::recon
