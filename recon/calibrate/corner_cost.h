// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <Eigen/Core>

#include "recon/calibrate/bundle.h"

namespace emberlock::recon {

/// A pose's block: a turn (angle times axis) on top of where it was linearised, and a place.
using PoseBlock = std::array<double, kPoseUnknowns>;
using LensBlock = std::array<double, kLensUnknowns>;

/// Rodrigues' rotation by a block's turn.
Eigen::Matrix3d rotation_by(const double* block);

inline constexpr double kNearest = 1e-6;  // metres in front of a camera

/// One corner's residuals, in standard deviations of its noise, and how they change with the unknowns. Poses
/// turn about where they were linearised, so their three angles are small and have no singularity. The
/// derivatives are written out: by automatic differentiation, of 21 unknowns each, they took more than half
/// of a calibration.
struct CornerEquations {
  const Eigen::Matrix3d* camera_rotation;  ///< camera_from_world
  const Eigen::Matrix3d* board_rotation;   ///< world_from_board
  Eigen::Vector3d corner;                  ///< board
  Eigen::Vector2d pixel;
  double weight;  ///< a pixel

  struct Slopes {
    Eigen::Matrix<double, 2, kLensUnknowns, Eigen::RowMajor> lens;
    Eigen::Matrix<double, 2, kPoseUnknowns, Eigen::RowMajor> camera;
    Eigen::Matrix<double, 2, kPoseUnknowns, Eigen::RowMajor> board;
  };

  /// Of the blocks' numbers; false where the corner isn't in front of the camera. `slopes` may be null.
  bool operator()(const double* lens, const double* camera, const double* board, double* residuals,
                  Slopes* slopes) const;
};

}  // namespace emberlock::recon
