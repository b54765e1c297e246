// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>

#include "apply/flame.h"
#include "apply/ray_light.h"
#include "apply/surfaces.h"
#include "base/random.h"

namespace emberlock::apply {

/// The light of flames that falls on surfaces: one random sample of the irradiance
///   E(x) = Int S(y) T(x, y) V(x, y) max(0, n . w) / |y - x|^2 dy,  w = (y - x) / |y - x|
/// over all flames; T is the smoke's transmittance, V whether no surface stands between. Its mean is E, but
/// for what the coarse grids of the flames leave out.
/// Of a part at distance r the share r^2 / (r^2 + a^2) comes from one place. Some are proposed: a voxel with
/// a chance proportional to its power (its integral of S), a place evenly in it; one of them is taken with a
/// chance proportional to what it would send here if nothing stood between (resampled importance sampling,
/// Talbot, Cline and Egbert 2005). The rest, which would have no bounded variance so, comes along one ray
/// whose direction is chosen with a chance proportional to its cosine (Malley's method, Pharr, Jakob and
/// Humphreys, "Physically Based Rendering", section 13.6.3). Far from a flame its a is 0 (Flame::close_by()).
class SurfaceLight {
 public:
  /// Both must outlive it.
  SurfaceLight(const std::vector<const Flame*>& flames, const Surfaces& surfaces);

  /// The random numbers of one of a pixel's samples, each in 0..1.
  struct Draw {
    std::uint64_t seed, stream;
    int sample, samples;

    [[nodiscard]] double number(int i) const {
      return random_uniform(seed, stream,
                            kEach * static_cast<std::uint64_t>(sample) + static_cast<std::uint64_t>(i));
    }
    /// Evenly spread over the pixel's samples.
    [[nodiscard]] double spread(int i) const { return (sample + number(i)) / samples; }
    static constexpr std::uint64_t kEach = 64;  ///< more than a sample takes
  };
  /// What a thread keeps from sample to sample.
  struct Scratch {
    RayLight along;
    std::vector<double> close_by;  ///< of each flame
  };
  /// At a surface with this normal (unit length), grey levels times steradian. `scratch` is the caller's own.
  [[nodiscard]] Eigen::Vector3d sample(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                       const Draw& draw, Scratch& scratch) const;

 private:
  /// A place that sends light, and how much would arrive if nothing stood between.
  struct Proposal {
    Eigen::Vector3d place;
    Eigen::Vector3d irradiance = Eigen::Vector3d::Zero();  ///< over the chance of its proposal
  };
  /// `which`: 0..1 over the flames' power.
  [[nodiscard]] Proposal proposed(const Eigen::Vector3d& place, const Eigen::Vector3d& normal, double which,
                                  const Eigen::Vector3d& within, const std::vector<double>& close_by) const;
  [[nodiscard]] Eigen::Vector3d from_one_place(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                               const Draw& draw, const std::vector<double>& close_by) const;
  [[nodiscard]] Eigen::Vector3d along_a_ray(const Eigen::Vector3d& place, const Eigen::Vector3d& normal,
                                            const Draw& draw, Scratch& scratch) const;

  struct Emitter {
    std::uint32_t flame, voxel;
  };
  const std::vector<const Flame*>& flames_;
  const Surfaces& surfaces_;
  std::vector<Emitter> emitters_;
  std::vector<double> power_until_;  ///< of each emitter: its own and all before it
  std::vector<std::uint32_t>
      guide_;  ///< the first emitter of each equal share of the power (Chen and Asau 1974)
};

}  // namespace emberlock::apply
