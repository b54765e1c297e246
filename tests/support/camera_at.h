// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include <Eigen/Dense>

#include "recon/views/camera_model.h"

namespace emberlock::test {

/// A camera that looks from `center` to `target`, upright but where it looks straight up or down.
inline recon::CameraModel camera_at(const Eigen::Vector3d& center, const Eigen::Vector3d& target,
                                    ImageSize size, double focal) {
  const Eigen::Vector3d up = std::abs((target - center).normalized().z()) > 0.9 ? Eigen::Vector3d::UnitY()
                                                                                : Eigen::Vector3d::UnitZ();
  return recon::look_at({size, focal, focal, size.width / 2.0, size.height / 2.0, {}}, center, target, up);
}

}  // namespace emberlock::test
