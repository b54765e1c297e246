// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include "apply/gltf_file.h"
#include "base/result.h"

namespace emberlock::apply {

/// So far from a surface its own rounding ends, metres.
inline double clear_of_surface(const Eigen::Vector3d& place) {
  return 1e-5 * (1 + place.cwiseAbs().maxCoeff());
}

/// A mesh that rays are cast through (Embree 3). Functions may be called by several threads.
class Surfaces {
 public:
  struct Hit {
    double distance;         ///< along the ray, metres
    Eigen::Vector3d normal;  ///< of the triangle, or between its vertices', unit length, on the side from
                             ///< which the ray came
    Eigen::Vector3d albedo;
    Eigen::Vector3d emitted;  ///< grey levels
  };

  /// Error (device): Embree can't be started, or memory is short.
  static Result<Surfaces> build(Mesh mesh);
  Surfaces(Surfaces&&) noexcept;
  Surfaces& operator=(Surfaces&&) noexcept;
  ~Surfaces();

  [[nodiscard]] bool empty() const;
  /// The first triangle that a ray meets farther than `nearest` metres; the direction has unit length.
  [[nodiscard]] std::optional<Hit> first(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                         double nearest = 0) const;
  /// Whether a triangle stands between two distances of a ray.
  [[nodiscard]] bool blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double from,
                             double to) const;

 private:
  struct Embree;
  explicit Surfaces(std::unique_ptr<Embree> embree);
  std::unique_ptr<Embree> embree_;
};

}  // namespace emberlock::apply
