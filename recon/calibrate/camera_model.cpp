#include "recon/calibrate/camera_model.h"

#include <cmath>

#include <Eigen/Geometry>

namespace emberlock {
namespace {

Eigen::Vector2d distort(const Eigen::Vector2d& p, const Distortion& d) {
  const double x = p.x();
  const double y = p.y();
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (d.k1 + r2 * (d.k2 + r2 * d.k3));
  return {x * radial + 2 * d.p1 * x * y + d.p2 * (r2 + 2 * x * x),
          y * radial + d.p1 * (r2 + 2 * y * y) + 2 * d.p2 * x * y};
}

Eigen::Vector2d undistort(const Eigen::Vector2d& distorted, const Distortion& d) {
  Eigen::Vector2d p = distorted;
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector2d residual = distort(p, d) - distorted;
    p -= residual;
    if (residual.squaredNorm() < 1e-24) break;
  }
  return p;
}

}  // namespace

Eigen::Vector2d CameraModel::project(const Eigen::Vector3d& world) const {
  const Eigen::Vector3d p = camera_from_world * world;
  Eigen::Vector2d normalised = p.head<2>() / p.z();
  if (!intrinsics.distortion.none()) normalised = distort(normalised, intrinsics.distortion);
  return {intrinsics.fx * normalised.x() + intrinsics.cx, intrinsics.fy * normalised.y() + intrinsics.cy};
}

Ray CameraModel::ray(const Eigen::Vector2d& pixel) const {
  Eigen::Vector2d normalised((pixel.x() - intrinsics.cx) / intrinsics.fx,
                             (pixel.y() - intrinsics.cy) / intrinsics.fy);
  if (!intrinsics.distortion.none()) normalised = undistort(normalised, intrinsics.distortion);
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

}  // namespace emberlock
