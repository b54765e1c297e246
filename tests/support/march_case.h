// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <vector>

#include "base/random.h"
#include "recon/effects/refraction.h"
#include "recon/hull/hull.h"
#include "recon/hull/ray_list.h"
#include "recon/views/camera_model.h"
#include "tests/support/marches.h"

namespace emberlock {

/// Rays through a medium with holes: two cameras, one of them close above.
struct MarchCase {
  recon::Hull medium;
  std::vector<recon::CameraModel> cameras;
  recon::RayList list;
};

struct MarchCaseOptions {
  Eigen::Vector3d size{0.2, 0.12, 0.16};  ///< metres
  int voxels = 20;
  double filled = 0.7;  ///< share of the voxels
  bool curved = false;  ///< through the gas of lens_of_gas()
  float step = 1;       ///< voxel edges
  std::uint64_t seed = 1;
};

/// Gas whose index rises by 0.03 in the middle of a cube of 40 cm: a hundred times what a flame does.
inline recon::RefractiveIndex lens_of_gas() {
  const recon::Grid grid = recon::grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.4)}, 20);
  std::vector<float> excess;
  for (int k = -10; k <= 10; ++k)
    for (int j = -10; j <= 10; ++j)
      for (int i = -10; i <= 10; ++i)
        excess.push_back(0.03F * std::exp(-0.04F * static_cast<float>(i * i + j * j + k * k)));
  return {grid, excess};
}

inline MarchCase march_case(const MarchCaseOptions& options = {}) {
  MarchCase out;
  recon::Hull& medium = out.medium;
  medium = recon::whole_grid(recon::grid_over({Eigen::Vector3d::Zero(), options.size}, options.voxels));
  medium.count = 0;
  for (std::size_t v = 0; v < medium.inside.size(); ++v) {
    medium.inside[v] = v == 0 || random_uniform(options.seed, 9, v / 4) < options.filled ? 1 : 0;
    medium.count += medium.inside[v];
  }
  const recon::Intrinsics lens{{40, 30}, 35, 35, 20, 15, {}};
  out.cameras = {
      recon::look_at(lens, {0.3, 0.1, 0.05}, Eigen::Vector3d::Zero()),
      recon::look_at(lens, {0.02, -0.03, 0.35}, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY())};
  const recon::RefractiveIndex index = lens_of_gas();
  const recon::IndexField gas = index.field(medium.grid);
  recon::RayListOptions clip;
  clip.step = options.step;
  if (options.curved) clip.gas = &gas;
  recon::Pool pool(1);
  out.list = recon::clip_rays({&out.cameras[0], &out.cameras[1]}, medium, clip, pool);
  return out;
}

/// Uniform numbers in [0, most) in lanes 0..2 and in [0, most_fourth) in lane 3.
template <class Real>
std::vector<recon::Quad<Real>> random_quads(std::size_t size, std::uint64_t seed, double most = 1,
                                            double most_fourth = 0) {
  std::vector<recon::Quad<Real>> out(size);
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t c = 0; c < 4; ++c)
      out[i].c[c] = static_cast<Real>((c < 3 ? most : most_fourth) * random_uniform(seed, c, i));
  return out;
}

/// Sum over lanes 0..lanes - 1.
template <class Real>
double dot(const std::vector<recon::Quad<Real>>& a, const std::vector<recon::Quad<Real>>& b, int lanes = 3) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < lanes; ++c) sum += static_cast<double>(a[i].c[c]) * static_cast<double>(b[i].c[c]);
  return sum;
}

}  // namespace emberlock
