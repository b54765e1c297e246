// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/corner_cost.h"

#include <cmath>

#include <Eigen/Geometry>

#include "recon/calibrate/pose.h"
#include "recon/kernels/lens.h"

namespace emberlock::recon {
namespace {

constexpr double kSmallTurn =
    1e-4;  // radians: for smaller rotations three terms of the series are exact in double precision

/// The derivative of rotation * v by the rotation vector (Gallego and Yezzi 2015, with the right Jacobian of
/// the rotation group).
Eigen::Matrix3d slope_of_rotated(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& turn,
                                 const Eigen::Vector3d& v) {
  const double angle = turn.norm();
  const double a2 = angle * angle;
  const double first = angle < kSmallTurn ? 0.5 - a2 / 24 : (1 - std::cos(angle)) / a2;
  const double second = angle < kSmallTurn ? 1.0 / 6 - a2 / 120 : (angle - std::sin(angle)) / (a2 * angle);
  const Eigen::Matrix3d across = cross_matrix(turn);
  const Eigen::Matrix3d right = Eigen::Matrix3d::Identity() - first * across + second * across * across;
  return -rotation * cross_matrix(v) * right;
}

}  // namespace

Eigen::Matrix3d rotation_by(const double* block) {
  const Eigen::Vector3d turn(block[0], block[1], block[2]);
  const double angle = turn.norm();
  if (angle == 0) return Eigen::Matrix3d::Identity();
  return Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
}

bool CornerEquations::operator()(const double* lens, const double* camera, const double* board,
                                 double* residuals, Slopes* slopes) const {
  const Eigen::Vector3d camera_turn(camera[0], camera[1], camera[2]);
  const Eigen::Vector3d board_turn(board[0], board[1], board[2]);
  const Eigen::Matrix3d turned_board = rotation_by(board);
  const Eigen::Matrix3d turned_camera = rotation_by(camera);
  const Eigen::Vector3d on_board = *board_rotation * corner;
  const Eigen::Vector3d from_camera = turned_board * on_board +
                                      Eigen::Vector3d(board[3], board[4], board[5]) -
                                      Eigen::Vector3d(camera[3], camera[4], camera[5]);
  const Eigen::Vector3d straight = *camera_rotation * from_camera;
  const Eigen::Vector3d p = turned_camera * straight;
  if (!(p.z() > kNearest)) return false;
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  const auto [fx, fy, cx, cy] = std::array{lens[0], lens[1], lens[2], lens[3]};
  const auto [k1, k2, p1, p2, k3] = std::array{lens[4], lens[5], lens[6], lens[7], lens[8]};
  double drawn_x = 0;
  double drawn_y = 0;
  brown_conrady(k1, k2, p1, p2, k3, x, y, drawn_x, drawn_y);
  residuals[0] = weight * (fx * drawn_x + cx - pixel.x());
  residuals[1] = weight * (fy * drawn_y + cy - pixel.y());
  if (slopes == nullptr) return true;

  const double r2 = x * x + y * y;
  const double r4 = r2 * r2;
  const double r6 = r2 * r4;
  const double wx = weight * fx;
  const double wy = weight * fy;
  slopes->lens << weight * drawn_x, 0, weight, 0, wx * x * r2, wx * x * r4, wx * 2 * x * y,
      wx * (r2 + 2 * x * x), wx * x * r6,  //
      0, weight * drawn_y, 0, weight, wy * y * r2, wy * y * r4, wy * (r2 + 2 * y * y), wy * 2 * x * y,
      wy * y * r6;

  const double radial = 1 + k1 * r2 + k2 * r4 + k3 * r6;
  const double by_r2 = k1 + 2 * k2 * r2 + 3 * k3 * r4;
  const double mixed = 2 * (x * y * by_r2 + p1 * x + p2 * y);
  Eigen::Matrix2d by_normalised;
  by_normalised << wx * (radial + 2 * x * x * by_r2 + 2 * p1 * y + 6 * p2 * x), wx * mixed, wy * mixed,
      wy * (radial + 2 * y * y * by_r2 + 6 * p1 * y + 2 * p2 * x);
  Eigen::Matrix<double, 2, 3> normalised_by_point;
  normalised_by_point << 1 / p.z(), 0, -x / p.z(), 0, 1 / p.z(), -y / p.z();
  const Eigen::Matrix<double, 2, 3> by_point = by_normalised * normalised_by_point;
  const Eigen::Matrix<double, 2, 3> by_world = by_point * turned_camera * *camera_rotation;
  slopes->camera.leftCols<3>() = by_point * slope_of_rotated(turned_camera, camera_turn, straight);
  slopes->camera.rightCols<3>() = -by_world;
  slopes->board.leftCols<3>() = by_world * slope_of_rotated(turned_board, board_turn, on_board);
  slopes->board.rightCols<3>() = by_world;
  return true;
}

}  // namespace emberlock::recon
