// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "base/result.h"
#include "recon/calibrate/camera_model.h"

namespace emberlock::recon {

/// The rotation nearest to a calibrated 3 x 3 matrix, which must be a rotation to within 1 %, times any
/// uniform positive scale (exporters leave one, and it moves no ray). Errors, without a place: not finite,
/// singular, sheared or unequally scaled, mirrored.
Result<Eigen::Matrix3d> nearest_rotation(const Eigen::Matrix3d& matrix);

/// From and to world_from_camera with OpenGL's camera axes (x right, y up, z backward). The upper left 3 x 3
/// of `world_from_camera` must be a rotation.
Rigid3 camera_from_world_of_opengl(const Eigen::Matrix4d& world_from_camera);
Eigen::Matrix4d opengl_world_from_camera(const Rigid3& camera_from_world);

/// The matrix m with m * w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Whether each pixel has a ray that projects back onto it, to 0.01 pixels: extreme distortions fold the
/// picture.
bool distortion_inverts(const Intrinsics& intrinsics);

}  // namespace emberlock::recon
