// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "recon/calibrate/bundle.h"

namespace emberlock::recon {

using PoseCovariance = Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns>;

/// The covariance of each camera's pose for a later check with the same lenses: given the lenses (a rotation
/// that compensates for a shift of the principal point has no visible effect), without the common motion of
/// all cameras (which isn't visible either), and treating cameras as independent. `covariance` is
/// covariance(bundle). Computed by conditioning, then Baarda's S-transformation with rotations weighted by
/// the rig's extent; times n / (n - 1), because of n similar cameras the difference of two has their full
/// covariance.
std::vector<PoseCovariance> relative_pose_covariances(const Bundle& bundle,
                                                      const Eigen::MatrixXd& covariance);

}  // namespace emberlock::recon
