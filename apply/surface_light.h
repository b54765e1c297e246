// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "apply/flame.h"
#include "apply/ray_light.h"
#include "apply/surfaces.h"

namespace emberlock::apply {

/// The light of flames that falls on surfaces: one random sample of the irradiance
///   E(x) = Int S(y) T(x, y) V(x, y) max(0, n . w) / |y - x|^2 dy,  w = (y - x) / |y - x|
/// over all flames; T is the smoke's transmittance, V whether no surface stands between. Its mean is E, but
/// for what the coarse grids of the flames leave out.
///   Of flames that are not near x, a voxel is chosen with a chance proportional to its power (its integral
///   of S), and a place evenly in it. Of those that x is near, where 1 / |y - x|^2 has no bound, all that
///   arrives from one direction, chosen with a chance proportional to its cosine (Malley's method, Pharr,
///   Jakob and Humphreys, "Physically Based Rendering", section 13.6.3).
class SurfaceLight {
 public:
  /// Both must outlive it.
  SurfaceLight(const std::vector<const Flame*>& flames, const Surfaces& surfaces);

  /// Random numbers for one sample, each in 0..1.
  struct Draw {
    double voxel;                   ///< which one
    std::array<double, 3> within;   ///< where in it
    std::array<double, 2> towards;  ///< the direction
  };
  /// At a surface with this normal (unit length), grey levels times steradian. `scratch` is the caller's own.
  [[nodiscard]] Eigen::Vector3d sample(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                       const Draw& draw, RayLight& scratch) const;

 private:
  [[nodiscard]] Eigen::Vector3d from_afar(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                          const Draw& draw) const;
  [[nodiscard]] Eigen::Vector3d from_nearby(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                            const Draw& draw, RayLight& scratch) const;

  struct Emitter {
    std::uint32_t flame, voxel;
  };
  const std::vector<const Flame*>& flames_;
  const Surfaces& surfaces_;
  std::vector<Emitter> emitters_;
  std::vector<double> power_until_;  ///< of each emitter: its own and all before it
};

}  // namespace emberlock::apply
