// SPDX-License-Identifier: Apache-2.0
#include "recon/views/camera_model.h"

#include <Eigen/Geometry>

namespace emberlock::recon {
Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& world) const {
  const Eigen::Vector3d p = camera_from_world * world;
  Eigen::Vector2d normalised = p.head<2>() / p.z();
  if (!intrinsics.distortion.none())
    intrinsics.distortion.distort(normalised.x(), normalised.y(), normalised.x(), normalised.y());
  return {intrinsics.fx * normalised.x() + intrinsics.cx, intrinsics.fy * normalised.y() + intrinsics.cy};
}

Ray CameraModel::ray(const Eigen::Vector2d& pixel) const {
  Eigen::Vector2d normalised((pixel.x() - intrinsics.cx) / intrinsics.fx,
                             (pixel.y() - intrinsics.cy) / intrinsics.fy);
  if (!intrinsics.distortion.none()) intrinsics.distortion.undistort(normalised.x(), normalised.y());
  const Eigen::Matrix3d world_from_camera = camera_from_world.rotation.transpose();
  return {center(), (world_from_camera * normalised.homogeneous()).normalized()};
}

CameraModel look_at(const Intrinsics& intrinsics, const Eigen::Vector3d& center,
                    const Eigen::Vector3d& target, const Eigen::Vector3d& up) {
  const Eigen::Vector3d forward = (target - center).normalized();
  const Eigen::Vector3d right = forward.cross(up).normalized();
  Rigid3 camera_from_world;
  camera_from_world.rotation.row(0) = right;
  camera_from_world.rotation.row(1) = forward.cross(right);
  camera_from_world.rotation.row(2) = forward;
  camera_from_world.translation = -(camera_from_world.rotation * center);
  return {intrinsics, camera_from_world};
}

}  // namespace emberlock::recon
