// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace emberlock::recon {

/// An axis-aligned box in the world: the volume that is reconstructed.
struct Box {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< metres
  Eigen::Vector3d size = Eigen::Vector3d::Zero();    ///< metres, every component > 0
};

}  // namespace emberlock::recon
