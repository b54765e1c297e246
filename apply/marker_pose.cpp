// SPDX-License-Identifier: Apache-2.0
#include "apply/marker_pose.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Dense>
#include <opencv2/calib3d.hpp>

#include "recon/calibrate/chain_poses.h"
#include "recon/calibrate/pose.h"

namespace emberlock::apply {
namespace {

/// V of exp((rho, omega)): the translation is V * rho.
Eigen::Matrix3d left_jacobian(const Eigen::Vector3d& omega) {
  const double angle = omega.norm();
  const Eigen::Matrix3d cross = recon::cross_matrix(omega);
  if (angle < 1e-6) return Eigen::Matrix3d::Identity() + cross / 2;
  const double squared = angle * angle;
  return Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / squared * cross +
         (angle - std::sin(angle)) / (squared * angle) * cross * cross;
}

double rms_of(const Eigen::VectorXd& off) {
  return std::sqrt(off.squaredNorm() / (static_cast<double>(off.size()) / 2));
}

/// Gauss-Newton with Levenberg's damping.
std::optional<MarkerPose> refined(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens,
                                  recon::Rigid3 pose) {
  Residuals now = residuals(points, lens, pose);
  if (!now.before_camera) return {};
  double damping = 1e-4;
  for (int round = 0; round < 20; ++round) {
    Eigen::Matrix<double, 6, 6> normal = now.by.transpose() * now.by;
    normal.diagonal() *= 1 + damping;
    const Twist step = normal.ldlt().solve(now.by.transpose() * now.off);
    if (!step.allFinite()) return {};
    const recon::Rigid3 next = recon::chained(rigid_of(step), pose);
    Residuals then = residuals(points, lens, next);
    if (then.before_camera && then.off.squaredNorm() <= now.off.squaredNorm()) {
      const bool done = step.norm() < 1e-10;
      pose = next;
      now = std::move(then);
      damping /= 10;
      if (done) break;
    } else {
      damping *= 10;
      if (damping > 1e6) break;
    }
  }
  return MarkerPose{pose, rms_of(now.off)};
}

}  // namespace

recon::Rigid3 rigid_of(const Twist& twist) {
  const Eigen::Vector3d omega = twist.tail<3>();
  const double angle = omega.norm();
  const Eigen::Matrix3d rotation =
      angle > 0 ? Eigen::AngleAxisd(angle, omega / angle).toRotationMatrix() : Eigen::Matrix3d::Identity();
  return {rotation, left_jacobian(omega) * twist.head<3>()};
}

Twist twist_of(const recon::Rigid3& motion) {
  const Eigen::AngleAxisd turn(motion.rotation);
  Twist twist;
  twist.tail<3>() = turn.angle() * turn.axis();
  twist.head<3>() = left_jacobian(twist.tail<3>()).inverse() * motion.translation;
  return twist;
}

Residuals residuals(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens,
                    const recon::Rigid3& camera_from_marker) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Residuals all{Eigen::VectorXd(2 * n), Eigen::Matrix<double, Eigen::Dynamic, 6>(2 * n, 6)};
  const recon::CameraModel at_origin{lens, {}};
  for (Eigen::Index i = 0; i < n; ++i) {
    const MarkerPoint& point = points[static_cast<std::size_t>(i)];
    const Eigen::Vector3d p = camera_from_marker * point.place;
    constexpr double kNearest = 1e-6;
    if (!(p.z() > kNearest)) {
      all.before_camera = false;
      return all;
    }
    all.off.segment<2>(2 * i) = point.pixel - at_origin.project(p);
    const double h = 1e-6 * p.z();
    Eigen::Matrix<double, 2, 3> by_place;
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3d aside = h * Eigen::Vector3d::Unit(a);
      by_place.col(a) = (at_origin.project(p + aside) - at_origin.project(p - aside)) / (2 * h);
    }
    all.by.block<2, 3>(2 * i, 0) = by_place;
    all.by.block<2, 3>(2 * i, 3) = -by_place * recon::cross_matrix(p);
  }
  return all;
}

double rms_off(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens,
               const recon::Rigid3& camera_from_marker) {
  return rms_of(residuals(points, lens, camera_from_marker).off);
}

std::vector<MarkerPose> marker_poses(const std::vector<MarkerPoint>& points, const recon::Intrinsics& lens) {
  if (points.size() < 4) return {};
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> directions;
  const recon::CameraModel at_origin{lens, {}};
  for (const MarkerPoint& point : points) {
    const Eigen::Vector3d ray = at_origin.ray(point.pixel).direction;
    places.emplace_back(point.place.x(), point.place.y(), point.place.z());
    directions.emplace_back(ray.x() / ray.z(), ray.y() / ray.z());
  }
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> moves;
  try {
    cv::solvePnPGeneric(places, directions, cv::Matx33d::eye(), cv::noArray(), turns, moves, false,
                        cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};  // all on one line
  }
  std::vector<MarkerPose> poses;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    Twist turn = Twist::Zero();
    recon::Rigid3 start;
    for (int a = 0; a < 3; ++a) {
      turn[3 + a] = turns[i].at<double>(a);
      start.translation[a] = moves[i].at<double>(a);
    }
    if (!turn.allFinite() || !start.translation.allFinite()) continue;
    start.rotation = rigid_of(turn).rotation;
    if (const auto pose = refined(points, lens, start)) poses.push_back(*pose);
  }
  std::sort(poses.begin(), poses.end(),
            [](const MarkerPose& a, const MarkerPose& b) { return a.rms < b.rms; });
  return poses;
}

}  // namespace emberlock::apply
