// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include <Eigen/Geometry>
#include <Eigen/SVD>

#include "tests/support/board_rig.h"

namespace emberlock::test {

struct PoseErrors {
  double place = 0;  ///< metres, of the worst camera's centre
  double turn = 0;   ///< radians, of the worst camera's axes
  double rays =
      0;  ///< radians: the turn of the worst camera's rays, seen over its whole picture. A turn of
          ///< the axes that a shift of the principal point undoes moves no ray, and no reconstruction
  double chi2 = 0;  ///< e' C^-1 e of all placed cameras' centres and turns, in the world's frame
  int freedom = 0;  ///< of chi2
};

/// A camera's centre and turn, found less true, in the order of the covariance.
inline Eigen::Matrix<double, 6, 1> pose_error(const recon::CameraModel& found,
                                              const recon::CameraModel& truth) {
  const Eigen::AngleAxisd turn(found.camera_from_world.rotation *
                               truth.camera_from_world.rotation.transpose());
  Eigen::Matrix<double, 6, 1> error;
  error << found.center() - truth.center(), turn.angle() * turn.axis();
  return error;
}

/// The angle of the rotation that best takes a camera's rays to the true ones, pixel by pixel.
inline double turn_of_rays(const recon::CameraModel& found, const recon::CameraModel& truth) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int y = 0; y <= 6; ++y) {
    for (int x = 0; x <= 8; ++x) {
      const Eigen::Vector2d pixel(truth.intrinsics.size.width * x / 8.0,
                                  truth.intrinsics.size.height * y / 6.0);
      sum += truth.ray(pixel).direction * found.ray(pixel).direction.transpose();
    }
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return Eigen::AngleAxisd(Eigen::Matrix3d(svd.matrixU() * svd.matrixV().transpose())).angle();
}

inline PoseErrors worst_of(const std::vector<Eigen::Matrix<double, 6, 1>>& errors) {
  PoseErrors worst;
  for (const auto& error : errors) {
    worst.place = std::max(worst.place, error.head<3>().norm());
    worst.turn = std::max(worst.turn, error.tail<3>().norm());
  }
  return worst;
}

/// In the world's frame, which is one board's pose: what that pose lacks is in every camera.
inline PoseErrors errors_in_world(const recon::RigCalibration& found,
                                  const std::vector<recon::CameraModel>& truth) {
  std::vector<Eigen::Matrix<double, 6, 1>> errors;
  const auto count = static_cast<Eigen::Index>(found.bundle.cameras.size());
  Eigen::VectorXd all(6 * count);
  Eigen::MatrixXd spread(6 * count, 6 * count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto at = static_cast<std::size_t>(i);
    errors.push_back(pose_error(found.bundle.cameras[at].model, truth[found.bundle_camera[at]]));
    all.segment<6>(6 * i) = errors.back();
    for (Eigen::Index j = 0; j < count; ++j) {
      spread.block<6, 6>(6 * i, 6 * j) =
          found.covariance.block<6, 6>(recon::kCameraUnknowns * i + recon::kLensUnknowns,
                                       recon::kCameraUnknowns * j + recon::kLensUnknowns);
    }
  }
  PoseErrors result = worst_of(errors);
  result.chi2 = all.dot(spread.ldlt().solve(all));
  result.freedom = static_cast<int>(6 * count);
  return result;
}

/// After the rigid motion of the found rig that fits the true centres and turns best (Umeyama 1991, without
/// scale): how well the cameras know of each other, which is all that a reconstruction feels.
inline PoseErrors errors_among_cameras(const recon::RigCalibration& found,
                                       const std::vector<recon::CameraModel>& truth) {
  Eigen::Matrix3d turns = Eigen::Matrix3d::Zero();  // true world from found world, summed
  Eigen::Vector3d found_middle = Eigen::Vector3d::Zero();
  Eigen::Vector3d true_middle = Eigen::Vector3d::Zero();
  const auto count = static_cast<double>(found.bundle.cameras.size());
  for (std::size_t i = 0; i < found.bundle.cameras.size(); ++i) {
    const recon::CameraModel& a = found.bundle.cameras[i].model;
    const recon::CameraModel& b = truth[found.bundle_camera[i]];
    turns += b.camera_from_world.rotation.transpose() * a.camera_from_world.rotation;
    found_middle += a.center() / count;
    true_middle += b.center() / count;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(turns, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  const recon::Rigid3 true_from_found{rotation, true_middle - rotation * found_middle};
  std::vector<Eigen::Matrix<double, 6, 1>> errors;
  double rays = 0;
  for (std::size_t i = 0; i < found.bundle.cameras.size(); ++i) {
    recon::CameraModel moved = found.bundle.cameras[i].model;
    moved.camera_from_world = chain(moved.camera_from_world, true_from_found.inverse());
    errors.push_back(pose_error(moved, truth[found.bundle_camera[i]]));
    rays = std::max(rays, turn_of_rays(moved, truth[found.bundle_camera[i]]));
  }
  PoseErrors result = worst_of(errors);
  result.rays = rays;
  return result;
}

}  // namespace emberlock::test
