// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace emberlock::apply {

/// A similarity, mirror images included: target = scale * rotation * source + translation (metres).
struct Placement {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< orthogonal; its determinant is -1 if mirrored
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();
  double scale = 1;  ///< > 0

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    return scale * (rotation * p) + translation;
  }
  [[nodiscard]] Placement inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation) / scale, 1 / scale};
  }
};

}  // namespace emberlock::apply
