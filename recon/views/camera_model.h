// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "base/image.h"
#include "base/result.h"
#include "recon/kernels/lens.h"

namespace emberlock::recon {

// Conventions of recon: world in metres, right-handed; camera axes as in OpenCV (x right, y down, z forward);
// pixel coordinates count from 0 at the corner of the top left pixel, so its centre is (0.5, 0.5).

struct Intrinsics {
  ImageSize size;
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< pixels
  Distortion distortion;
};

/// target_from_source: x_target = rotation * x_source + translation (metres).
struct Rigid3 {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d translation = Eigen::Vector3d::Zero();

  [[nodiscard]] Eigen::Vector3d operator*(const Eigen::Vector3d& p) const {
    return rotation * p + translation;
  }
  [[nodiscard]] Rigid3 inverse() const {
    return {rotation.transpose(), -(rotation.transpose() * translation)};
  }
};

struct Ray {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  ///< unit length
};

/// A calibrated camera: converts world points to pixels, and pixels to world rays.
struct CameraModel {
  Intrinsics intrinsics;
  Rigid3 camera_from_world;

  [[nodiscard]] Eigen::Vector3d center() const { return camera_from_world.inverse().translation; }
  /// Pixel of a world point; the point must lie in front of the camera (z > 0).
  [[nodiscard]] Eigen::Vector2d project(const Eigen::Vector3d& world) const;
  /// The ray from the camera's centre through a pixel position; distortion is removed by fixed-point
  /// iteration.
  [[nodiscard]] Ray ray(const Eigen::Vector2d& pixel) const;
};

/// A camera at `center` that looks at `target`, with the world's `up` pointing up in its image.
CameraModel look_at(const Intrinsics& intrinsics, const Eigen::Vector3d& center,
                    const Eigen::Vector3d& target, const Eigen::Vector3d& up = Eigen::Vector3d::UnitZ());

}  // namespace emberlock::recon
