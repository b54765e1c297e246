// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include <Eigen/Core>

#include "base/result.h"
#include "paper/baselines/method.h"
#include "recon/kernels/grid.h"
#include "recon/render/volume.h"
#include "recon/views/view.h"

namespace emberlock::paper {

// What the methods share that take all cameras to stand in one horizontal plane, infinitely far away. Each
// horizontal layer of key points is then a slice for itself: a view sees of it a profile, one value a ray,
// and the ray's value is the line integral of the slice's emission. The middle ray passes the vertical axis
// through the middle of the box, the others lie a voxel edge apart; `across` is the horizontal unit vector
// that points to the right in a view's picture.

/// The layers of a grid as slices.
struct ParallelSlices {
  recon::Grid grid;
  Eigen::Vector2d axis = Eigen::Vector2d::Zero();  ///< x and y of the vertical axis, metres
  int offsets = 0;  ///< rays of a profile, an odd number: they reach the corners of a slice

  [[nodiscard]] std::size_t layer() const;    ///< floats of a slice, RGB interleaved: 3 * nx * ny
  [[nodiscard]] std::size_t profile() const;  ///< floats of a profile, RGB interleaved: 3 * offsets
  /// A key point's horizontal place relative to the axis, metres.
  [[nodiscard]] Eigen::Vector2d place(int i, int j) const;
};
ParallelSlices slices_over(const recon::Grid& grid);

/// A view as if by parallel rays: profiles in grey levels, layer k from k * profile() on.
struct ParallelPicture {
  Eigen::Vector2d across = Eigen::Vector2d::UnitX();
  std::vector<float> light;
};

/// The input views' pictures, in their order, resampled: the value of a parallel ray is that of the picture
/// where it shows the ray's nearest point to the axis, the mean over a square of one voxel edge there. Rays
/// are thus right in the plane through the axis that faces the camera; nearer and farther ones belong to
/// other offsets and heights in a picture by perspective, and a ray from above or below passes through other
/// layers. That is what the methods neglect. What lies beyond the picture is dark, and
/// so are pixels that show no flame by their noise_mask(). Errors: no input view, one
/// whose camera stands on the axis.
Result<std::vector<ParallelPicture>> parallel_pictures(const recon::Scene& scene,
                                                       const ParallelSlices& slices);

/// A slice's profile along one direction, and its transpose. A key point is a tent of one voxel edge; its
/// light goes to the two rays that it lies between.
class ParallelProjector {
 public:
  ParallelProjector(const ParallelSlices& slices, const Eigen::Vector2d& across);

  /// Sets `profile` to the line integrals of `layer`, grey levels of grey levels per metre. Only `points` (i
  /// + nx * j) are looked at.
  void project(const float* layer, std::span<const std::uint32_t> points, float* profile) const;
  /// Adds to `points` of `layer` the transpose of `profile`.
  void back_project(const float* profile, std::span<const std::uint32_t> points, float* layer) const;

 private:
  struct Between {
    std::int32_t ray;  ///< and the next one
    float next;        ///< its part
  };
  std::vector<Between> between_;  ///< one a key point
  std::size_t profile_;
  float edge_;
};

/// Calls work(k) once for each layer, on the options' threads; the layers that have not begun when the
/// options' stop() says so are left out.
void each_layer(const ParallelSlices& slices, const MethodOptions& options,
                const std::function<void(int k)>& work);

/// |sine| of the angle between two views' rays: 0 where both see the same lines.
double crossing(const ParallelPicture& a, const ParallelPicture& b);

/// A volume as a method's result: emission alone, in the voxels that have some. Errors: not_converged where a
/// value isn't finite, or where the input views are shown worse than darkness shows them.
Result<MethodResult> checked_result(const recon::Scene& scene, recon::Volume volume,
                                    const MethodOptions& options);

/// Refuses what no method can take: a scene that check_scene() refuses, voxels that aren't 8..256.
Status check_method(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
