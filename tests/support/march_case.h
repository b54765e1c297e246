#pragma once

#include <cmath>
#include <vector>

#include "base/random.h"
#include "recon/calibrate/camera_model.h"
#include "recon/effects/refraction.h"
#include "recon/hull/hull.h"
#include "recon/hull/ray_list.h"
#include "recon/render/march_table.h"

namespace emberlock {

/// Rays through a medium with holes: two cameras, one of them close above.
struct MarchCase {
  Hull medium;
  std::vector<CameraModel> cameras;
  RayList list;
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
inline RefractiveIndex lens_of_gas() {
  const Grid grid = grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.4)}, 20);
  std::vector<float> excess;
  for (int k = -10; k <= 10; ++k)
    for (int j = -10; j <= 10; ++j)
      for (int i = -10; i <= 10; ++i)
        excess.push_back(0.03F * std::exp(-0.04F * static_cast<float>(i * i + j * j + k * k)));
  return {grid, excess};
}

inline MarchCase march_case(const MarchCaseOptions& options = {}) {
  MarchCase out;
  Hull& medium = out.medium;
  medium = whole_grid(grid_over({Eigen::Vector3d::Zero(), options.size}, options.voxels));
  medium.count = 0;
  for (std::size_t v = 0; v < medium.inside.size(); ++v) {
    medium.inside[v] = v == 0 || random_uniform(options.seed, 9, v / 4) < options.filled ? 1 : 0;
    medium.count += medium.inside[v];
  }
  const Intrinsics lens{{40, 30}, 35, 35, 20, 15, {}};
  out.cameras = {look_at(lens, {0.3, 0.1, 0.05}, Eigen::Vector3d::Zero()),
                 look_at(lens, {0.02, -0.03, 0.35}, Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitY())};
  const RefractiveIndex index = lens_of_gas();
  const IndexField gas = index.field(medium.grid);
  RayListOptions clip;
  clip.step = options.step;
  if (options.curved) clip.gas = &gas;
  Pool pool(1);
  out.list = clip_rays({&out.cameras[0], &out.cameras[1]}, medium, clip, pool);
  return out;
}

/// The marches of one table over all rays of a list, on the calling thread.
template <class Real>
class Marcher {
 public:
  using Values = std::vector<Quad<Real>>;

  explicit Marcher(const RayList& list, const MarchTable<Real>& table = march_table<Real>())
      : list_(list), table_(table), travel_(list.bends.empty() ? Travel::straight : Travel::curved) {}

  /// Radiance, and transmittance in lane 3, of each ray; `sigma` of constant extinction.
  [[nodiscard]] Values forward(Absorb absorb, const Values& volume, Real sigma = 0) const {
    Values seen(list_.rays.size());
    MarchWork<Real> work = work_on(volume, sigma);
    work.residual = seen.data();
    table_.forward_of(absorb, travel_)(work, 0, seen.size());
    return seen;
  }
  /// A^T residual at the key points, under no or constant extinction.
  [[nodiscard]] Values adjoint(Absorb absorb, Values residual, Real sigma = 0) const {
    Values gradient(list_.grid.size());
    MarchWork<Real> work = work_on({}, sigma);
    work.residual = residual.data();
    work.gradient = gradient.data();
    scatter(absorb, work);
    return gradient;
  }

  struct Field {
    Values residual;  ///< as judged, one a ray
    Values samples;   ///< what FieldForward leaves
  };
  [[nodiscard]] Field field_forward(const Values& volume, const Judge<Real>& judge) const {
    Field field{Values(list_.rays.size()), Values(list_.first_sample(list_.rays.size()))};
    MarchWork<Real> work = work_on(volume, 0);
    work.residual = field.residual.data();
    work.samples = field.samples.data();
    table_.field_forward[static_cast<int>(travel_)](work, judge, 0, list_.rays.size());
    return field;
  }
  /// Of 1/2 |residual|^2 by emission (lanes 0..2) and extinction (lane 3).
  [[nodiscard]] Values field_adjoint(Field field) const {
    Values gradient(list_.grid.size());
    MarchWork<Real> work = work_on({}, 0);
    work.residual = field.residual.data();
    work.samples = field.samples.data();
    work.gradient = gradient.data();
    scatter(Absorb::field, work);
    return gradient;
  }

 private:
  [[nodiscard]] MarchWork<Real> work_on(const Values& volume, Real sigma) const {
    MarchWork<Real> work;
    work.rays = list_.table();
    work.volume = volume.data();
    work.sigma = sigma;
    return work;
  }
  void scatter(Absorb absorb, const MarchWork<Real>& work) const {
    for (std::uint32_t n = 0; n < list_.runs.size(); ++n) table_.adjoint_of(absorb, travel_)(work, &n, 1);
  }

  const RayList& list_;
  const MarchTable<Real>& table_;
  Travel travel_;
};

/// Uniform numbers in [0, most) in lanes 0..2 and in [0, most_fourth) in lane 3.
template <class Real>
std::vector<Quad<Real>> random_quads(std::size_t size, std::uint64_t seed, double most = 1,
                                     double most_fourth = 0) {
  std::vector<Quad<Real>> out(size);
  for (std::size_t i = 0; i < size; ++i)
    for (std::size_t c = 0; c < 4; ++c)
      out[i].c[c] = static_cast<Real>((c < 3 ? most : most_fourth) * random_uniform(seed, c, i));
  return out;
}

/// Sum over lanes 0..lanes - 1.
template <class Real>
double dot(const std::vector<Quad<Real>>& a, const std::vector<Quad<Real>>& b, int lanes = 3) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    for (int c = 0; c < lanes; ++c) sum += static_cast<double>(a[i].c[c]) * static_cast<double>(b[i].c[c]);
  return sum;
}

}  // namespace emberlock
