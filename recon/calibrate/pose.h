// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "base/result.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {

/// The rotation closest to a calibrated 3 x 3 matrix. The matrix must be a rotation to within 1 %, times any
/// uniform positive scale (some exporters leave one, and it has no effect on rays). Errors, without where:
/// not finite, singular, sheared, unequally scaled or mirrored.
Result<Eigen::Matrix3d> nearest_rotation(const Eigen::Matrix3d& matrix);

/// Conversion from world_from_camera with OpenGL's camera axes (x right, y up, z backward), and back. The
/// upper left 3 x 3 of `world_from_camera` must be a rotation.
Rigid3 camera_from_world_of_opengl(const Eigen::Matrix4d& world_from_camera);
Eigen::Matrix4d opengl_world_from_camera(const Rigid3& camera_from_world);

/// The matrix m with m * w = v x w.
Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v);

/// Whether each pixel has a ray that projects back to it within 0.01 pixels. Extreme distortions fold the
/// picture.
bool distortion_inverts(const Intrinsics& intrinsics);

}  // namespace emberlock::recon
