// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/pose.h"

#include <Eigen/LU>
#include <Eigen/SVD>

namespace emberlock::recon {
namespace {

constexpr double kRotationTolerance = 0.01;
constexpr double kDistortionTolerance = 0.01;  // pixels

// Its own inverse: OpenGL's y and z have the opposite direction.
const Eigen::DiagonalMatrix<double, 3> kOpenglFromOpencv(1, -1, -1);

}  // namespace

Result<Eigen::Matrix3d> nearest_rotation(const Eigen::Matrix3d& matrix) {
  const auto error = [](const char* what, const char* remedy) {
    return Error{ErrorKind::bad_input, what, "", remedy};
  };
  if (!matrix.allFinite()) return error("is not finite", "Give finite numbers");
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  // A copy, because with a reference GCC 12 warns that the values may be uninitialized.
  const Eigen::Vector3d scales = svd.singularValues();  // NOLINT(performance-unnecessary-copy-initialization)
  const double largest = scales.maxCoeff();
  const double smallest = scales.minCoeff();
  if (largest < 1e-9 || smallest < 1e-6 * largest) {
    return error("is singular", "Export the camera's pose again: the 3 x 3 part must be a rotation");
  }
  if (smallest < (1 - kRotationTolerance) * largest) {
    return error("is no rotation: its axes are not orthogonal or not of one length",
                 "Export the camera's pose again, without shear or unequal scale");
  }
  if (matrix.determinant() < 0) {
    return error("mirrors the world",
                 "Use a right-handed world: flip one world axis in all frames and the box");
  }
  return Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose());
}

Rigid3 camera_from_world_of_opengl(const Eigen::Matrix4d& world_from_camera) {
  const Rigid3 world_from_opencv{world_from_camera.topLeftCorner<3, 3>() * kOpenglFromOpencv,
                                 world_from_camera.topRightCorner<3, 1>()};
  return world_from_opencv.inverse();
}

Eigen::Matrix4d opengl_world_from_camera(const Rigid3& camera_from_world) {
  const Rigid3 world_from_opencv = camera_from_world.inverse();
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = world_from_opencv.rotation * kOpenglFromOpencv;
  m.topRightCorner<3, 1>() = world_from_opencv.translation;
  return m;
}

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

bool distortion_inverts(const Intrinsics& intrinsics) {
  if (intrinsics.distortion.none()) return true;
  const CameraModel camera{intrinsics, {}};
  constexpr int kSteps = 8;
  for (int iy = 0; iy <= kSteps; ++iy) {
    for (int ix = 0; ix <= kSteps; ++ix) {
      const Eigen::Vector2d pixel(static_cast<double>(intrinsics.size.width * ix) / kSteps,
                                  static_cast<double>(intrinsics.size.height * iy) / kSteps);
      const double error = (camera.project(camera.ray(pixel).direction) - pixel).norm();
      if (!(error < kDistortionTolerance)) return false;
    }
  }
  return true;
}

}  // namespace emberlock::recon
