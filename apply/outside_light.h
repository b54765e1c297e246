// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "apply/flame.h"
#include "apply/surfaces.h"
#include "recon/effects/effects.h"

namespace emberlock::apply {

/// A scene's light that isn't of its flames: recon::Light (`none`, `distant` or `nearby`, in the world) as
/// matter of albedo 1 scatters it, so its strength is a quarter of the radiance of a white surface that faces
/// it, from a metre if it is nearby. What comes from it to a place is hidden by surfaces and dimmed by smoke;
/// `ambient` comes everywhere.
class OutsideLight {
 public:
  /// All must outlive it.
  OutsideLight(const recon::Light& light, const std::vector<const Flame*>& flames, const Surfaces& surfaces)
      : light_(light), flames_(flames), surfaces_(surfaces) {}

  /// The share that comes past surfaces, and through all flames but one; 1 where there is no such light.
  [[nodiscard]] double reaches(const Eigen::Vector3d& place, const Flame* but = nullptr) const;
  /// The radiance of a white surface, with this normal (unit length), by it and by what comes from all sides.
  [[nodiscard]] Eigen::Vector3d on_white(const Eigen::Vector3d& place, const Eigen::Vector3d& normal) const;

 private:
  const recon::Light& light_;
  const std::vector<const Flame*>& flames_;
  const Surfaces& surfaces_;
};

}  // namespace emberlock::apply
