// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "apply/marker.h"
#include "recon/views/camera_model.h"

namespace emberlock::apply {

/// A pose that explains what is seen of a marker.
struct MarkerPose {
  recon::Rigid3 camera_from_marker;
  double rms = 0;  ///< of the reprojected points, pixels: root of the mean squared distance
};

/// At least four points that aren't on one line. A flat thing that is seen from afar has two poses that
/// explain it nearly as well (Collins and Bartoli 2014, "Infinitesimal plane-based pose estimation"): both,
/// the better one first, each refined to the least squares of its pixels through the lens. Empty where there
/// is none before the camera.
std::vector<MarkerPose> marker_poses(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens);

/// A small motion (rho, omega): rotated by the vector omega, with exp() of se(3), left of a pose.
using Twist = Eigen::Matrix<double, 6, 1>;
recon::Rigid3 rigid_of(const Twist& twist);
/// Its inverse, of rotations by less than pi.
Twist twist_of(const recon::Rigid3& motion);

/// How far the points are seen from where a pose puts them, and how that changes with rigid_of(twist) left of
/// it: two rows a point.
struct Residuals {
  Eigen::VectorXd off;                          ///< seen minus projected, pixels
  Eigen::Matrix<double, Eigen::Dynamic, 6> by;  ///< of the projection
  bool before_camera = true;                    ///< all points are
};
Residuals residuals(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens,
                    const recon::Rigid3& camera_from_marker);

/// Root of the mean squared distance between the points and where a pose puts them, pixels.
double rms_off(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens,
               const recon::Rigid3& camera_from_marker);

}  // namespace emberlock::apply
