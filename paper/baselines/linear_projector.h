// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "base/result.h"
#include "paper/baselines/method.h"
#include "recon/adjust/problem.h"
#include "recon/compute/pool.h"
#include "recon/effects/refraction.h"
#include "recon/hull/hull.h"
#include "recon/kernels/rgba.h"
#include "recon/render/march_table.h"
#include "recon/render/volume.h"
#include "recon/views/view.h"

namespace emberlock::paper {

// What tomography of light that nothing absorbs has in common: pictures b = A x, where x is the emission at
// the key points of the views' visual hull.

/// R, G and B of key points (grey levels per voxel edge) or of rays (grey levels), in lanes 0 to 2; lane 3
/// is 0.
using Light = std::vector<recon::Rgba>;
using Channels = std::array<double, 3>;

/// The input views and what they leave of the grid over the scene's box.
struct TomographyInput {
  std::vector<const recon::View*> views;  ///< of the scene that was given
  recon::Hull hull;
};

/// Errors: those of recon::check_scene() and recon::carve(); voxels or threads out of their range; fewer
/// input views than `fewest`.
Result<TomographyInput> find_input(const recon::Scene& scene, const MethodOptions& options,
                                   std::size_t fewest);

/// The same on a grid that is halved until it has at most so many voxels along its longest side.
TomographyInput coarse_input(TomographyInput input, int most_voxels);

/// The stride, in pixels, that leaves each voxel some one and a half pixels: of what searches for its own
/// settings.
int stride_for(const TomographyInput& input);

/// Pictures of unknowns x >= 0 in which they are linear: b = A x.
class LinearMap {
 public:
  LinearMap() = default;
  virtual ~LinearMap() = default;
  LinearMap(LinearMap&&) = delete;
  LinearMap& operator=(LinearMap&&) = delete;
  [[nodiscard]] virtual std::size_t unknowns() const = 0;
  [[nodiscard]] virtual const Light& seen() const = 0;  ///< b, one a ray
  [[nodiscard]] virtual recon::Pool& pool() const = 0;
  /// y = A x.
  virtual void project(const Light& x, Light& y) const = 0;
  /// x = A^T y.
  virtual void back_project(const Light& y, Light& x) const = 0;
};

/// A: the integral of trilinear emission along each pixel's ray through the hull, by render_view()'s march.
/// Pixels whose ray misses the hull have no ray. The same bits for any number of threads.
class LinearProjector final : public LinearMap {
 public:
  /// Takes every `stride`-th pixel along both axes. `gas` bends the rays where it is given. Hull, views'
  /// pictures and pool must outlive it.
  LinearProjector(const std::vector<const recon::View*>& views, const recon::Hull& hull, int stride,
                  recon::Pool& pool, const recon::RefractiveIndex* gas = nullptr);

  /// The hull's part of its grid.
  [[nodiscard]] const recon::Grid& grid() const { return problem_.grid(); }
  [[nodiscard]] std::size_t unknowns() const override { return grid().size(); }
  [[nodiscard]] std::size_t rays() const { return problem_.rays(); }
  [[nodiscard]] const Light& seen() const override { return seen_; }
  [[nodiscard]] recon::Pool& pool() const override { return pool_; }
  /// The rays as they are marched.
  [[nodiscard]] const recon::RayList& list() const { return problem_.list; }
  /// Whether a key point belongs to a voxel of the hull.
  [[nodiscard]] bool takes_part(std::size_t key_point) const { return problem_.share[key_point] > 0; }

  void project(const Light& x, Light& y) const override;
  void back_project(const Light& y, Light& x) const override;
  /// x on the hull's whole grid.
  [[nodiscard]] recon::Volume volume(const Light& x) const;

 private:
  [[nodiscard]] recon::Travel travel() const {
    return problem_.list.curved ? recon::Travel::curved : recon::Travel::straight;
  }

  const recon::Hull& hull_;
  recon::Pool& pool_;
  recon::Problem problem_;
  Light seen_;
};

/// Squares of A x - b over the rays, by channel.
Channels squares_left(const LinearMap& map, const Light& x);
/// R, G and B together.
inline double sum_of(const Channels& c) { return c[0] + c[1] + c[2]; }
/// a . b by channel.
Channels dot(const Light& a, const Light& b, recon::Pool& pool);
/// to = a + s b by channel; `to` may be either.
void combine(const Light& a, const Channels& s, const Light& b, Light& to, recon::Pool& pool);
/// Calls act(i) for every i below `count`, on all threads.
template <class Act>
void each_of(std::size_t count, recon::Pool& pool, const Act& act) {
  constexpr int kTasks = 64;
  pool.run(kTasks, [&](int task) {
    const recon::Slice mine = recon::slice(count, kTasks, task);
    for (std::size_t i = mine.begin; i < mine.end; ++i) act(i);
  });
}

/// What x is worth. Errors: not_converged where it isn't finite or shows the rays no better than darkness.
Result<MethodResult> conclude(const TomographyInput& input, const LinearProjector& projector, const Light& x,
                              int iterations);

}  // namespace emberlock::paper
