// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "recon/calibrate/bundle.h"

namespace emberlock::recon {

using PoseCovariance = Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns>;

/// What a later check with the same lenses may expect of each camera's pose: its covariance given the lenses
/// (a turn that a shift of the principal point undoes shows nowhere), the motion of all cameras together
/// taken out (nor does that show), as if cameras were independent. `covariance` is covariance(bundle). By
/// conditioning, then Baarda's S-transformation with turns weighed as the rig's extent; times n / (n - 1), by
/// which the difference of two of n like cameras keeps its own.
std::vector<PoseCovariance> relative_pose_covariances(const Bundle& bundle,
                                                      const Eigen::MatrixXd& covariance);

}  // namespace emberlock::recon
