// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/relative_poses.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "recon/calibrate/pose.h"

namespace emberlock::recon {
namespace {

/// Covariance of all poses for given lenses. Fixed parameters have no variance.
Eigen::MatrixXd given_lenses(const Eigen::MatrixXd& covariance, std::size_t cameras) {
  std::vector<Eigen::Index> poses;
  std::vector<Eigen::Index> lenses;
  for (Eigen::Index c = 0; c < static_cast<Eigen::Index>(cameras); ++c) {
    for (int i = 0; i < kCameraUnknowns; ++i) {
      const Eigen::Index at = c * kCameraUnknowns + i;
      if (i >= kLensUnknowns) {
        poses.push_back(at);
      } else if (covariance(at, at) > 0) {
        lenses.push_back(at);
      }
    }
  }
  // In standard deviations, because k1 and pixels differ by orders of magnitude.
  const Eigen::VectorXd scale = covariance(lenses, lenses).diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd own = scale.asDiagonal() * covariance(lenses, lenses) * scale.asDiagonal();
  const Eigen::MatrixXd across = covariance(poses, lenses) * scale.asDiagonal();
  return covariance(poses, poses) - across * own.ldlt().solve(across.transpose());
}

}  // namespace

std::vector<PoseCovariance> relative_pose_covariances(const Bundle& bundle,
                                                      const Eigen::MatrixXd& covariance) {
  const std::size_t count = bundle.cameras.size();
  std::vector<PoseCovariance> result(count, PoseCovariance::Zero());
  if (count < 2) return result;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const BundleCamera& camera : bundle.cameras)
    middle += camera.model.center() / static_cast<double>(count);
  double extent = 0;
  for (const BundleCamera& camera : bundle.cameras)
    extent += (camera.model.center() - middle).squaredNorm() / static_cast<double>(count);
  extent = std::max(std::sqrt(extent), 1e-6);
  const auto size = static_cast<Eigen::Index>(count) * kPoseUnknowns;
  Eigen::MatrixXd together(size, kPoseUnknowns);  // derivatives of all poses by a motion of the whole rig
  Eigen::VectorXd weight(size);
  for (std::size_t c = 0; c < count; ++c) {
    const CameraModel& camera = bundle.cameras[c].model;
    const Eigen::Index at = static_cast<Eigen::Index>(c) * kPoseUnknowns;
    together.block<3, 3>(at, 0).setIdentity();
    together.block<3, 3>(at, 3) = -cross_matrix(camera.center() - middle);
    together.block<3, 3>(at + 3, 0).setZero();
    together.block<3, 3>(at + 3, 3) = -camera.camera_from_world.rotation;
    weight.segment<3>(at).setConstant(1 / (extent * extent));
    weight.segment<3>(at + 3).setOnes();
  }
  const Eigen::MatrixXd weighed = together.transpose() * weight.asDiagonal();
  const Eigen::MatrixXd rest =
      Eigen::MatrixXd::Identity(size, size) - together * (weighed * together).ldlt().solve(weighed);
  const Eigen::MatrixXd spread = rest * given_lenses(covariance, count) * rest.transpose();
  const double factor = static_cast<double>(count) / static_cast<double>(count - 1);
  for (std::size_t c = 0; c < count; ++c) {
    const Eigen::Index at = static_cast<Eigen::Index>(c) * kPoseUnknowns;
    const PoseCovariance own = spread.block<kPoseUnknowns, kPoseUnknowns>(at, at);
    result[c] = 0.5 * factor * (own + own.transpose());
  }
  return result;
}

}  // namespace emberlock::recon
