// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include <Eigen/Core>

#include "recon/adjust/problem.h"
#include "recon/render/march_table.h"
#include "recon/temperature/emitter.h"

namespace emberlock::recon {

/// The share of each channel in an emitter's light and its slope by temperature, 1/K: EmitterTable's, made
/// smooth (Catmull and Rom's cubics even in 1 / T), so that a gradient is one everywhere. Beyond the table as
/// at its end.
class EmitterColours {
 public:
  explicit EmitterColours(const EmitterTable& table);
  struct At {
    std::array<double, 3> value = {}, slope = {};
  };
  [[nodiscard]] At at(double kelvin) const;

 private:
  double coldest_, hottest_;
  std::vector<std::array<double, 3>> knots_;
};

/// What is known before temperatures and brightness are sought together, at the key points of a problem's
/// grid.
struct GlowStart {
  std::vector<Rgba> light;  ///< emission, levels a voxel edge; lane 3: extinction a voxel edge
  std::vector<float>
      total;  ///< of an emitter's three channels, levels a voxel edge; 0: `light` stays as it is
  Absorb absorb = Absorb::nothing;
  double sigma = 0;  ///< of constant extinction, a voxel edge
  float white = 0;   ///< as in Optics
};

/// How firmly neighbours are tied along a sheet of light, over the mean curvature of what the pictures say.
struct GlowTies {
  double kelvin = 0, brightness = 0;
};

/// Brightness (the logarithm of the channels' sum over the start's) and temperature at key points.
template <class Real>
struct GlowField {
  std::vector<Real> brightness, kelvin;
};

/// The cost of temperatures and brightness together:
///   sum over rays of 1/2 r^T P r + sum over neighbours of 1/2 t (a (dT)^2 + b (d brightness)^2)
/// r is what a ray shows beyond its pixel, P the inverse of r's covariance over the rays as the start leaves
/// it: noise and what the model can't show, most of it common to the channels. t = 1 - n^2 along an axis
/// where the light's gradient has the direction n: ties run along sheets. On the CPU; the same bits for every
/// number of threads.
template <class Real>
class GlowCost {
 public:
  /// The problem must be the CPU's and outlive it, and so must the pool.
  GlowCost(const Problem& problem, GlowStart start, EmitterColours colours, Pool& pool);

  /// Where it begins to weigh: P and the ties, from the residuals and curvatures there.
  void weigh(const GlowField<Real>& at, const GlowTies& ties);
  /// The cost and its gradient, exact but for rounding.
  double operator()(const GlowField<Real>& at, GlowField<Real>& slope);
  /// A step against the gradient at a point, as long as a majoriser of the cost's Gauss-Newton Hessian
  /// allows, times `length`: A^T A 1 for the rays, twice a key point's ties for the neighbours.
  void descend(GlowField<Real>& at, const GlowField<Real>& slope, double length) const;

  [[nodiscard]] bool moves(std::size_t point) const { return start_.total[point] > 0; }

 private:
  void show(const GlowField<Real>& at);
  [[nodiscard]] MarchWork<Real> work(int subset);
  /// Of each subset the residuals of what is shown, what `act(begin, end)` makes of them, and gradient +=
  /// A^T residual, from 0 on.
  template <class Act>
  void march_and_spread(const PixelResidual<Real>& pixel, const Act& act);
  void march(const PixelResidual<Real>& pixel, int subset);
  void spread(int subset);
  double data(std::size_t begin, std::size_t end);
  double tied(const GlowField<Real>& at, GlowField<Real>& slope) const;
  [[nodiscard]] Eigen::Matrix<double, 3, 2> derivative(const GlowField<Real>& at, std::size_t point) const;
  [[nodiscard]] Eigen::Matrix2d curvature(const GlowField<Real>& at, std::size_t point) const;
  template <class Act>
  void each_point(const Act& act) const;

  const Problem& problem_;
  GlowStart start_;
  EmitterColours colours_;
  Pool& pool_;
  const MarchTable<Real>& table_ = march_table<Real>();
  int travel_;
  std::vector<std::array<Real, 3>> ties_;  // along x, y and z to the next point, 0..1
  std::vector<Quad<Real>> shown_, residual_, gradient_;
  std::vector<Quad<Real>> samples_;  // of a subset, where the extinction is a field
  std::vector<Quad<Real>> weight_;   // A^T A 1 of each channel
  Eigen::Matrix3d precision_ = Eigen::Matrix3d::Identity();
  double tie_kelvin_ = 0, tie_brightness_ = 0;
};

}  // namespace emberlock::recon
