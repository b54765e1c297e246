// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include <Eigen/Core>

#include "recon/calibrate/bundle.h"

namespace emberlock::recon {

/// The parameters of a pose: a rotation (angle times axis) relative to its linearisation point, and a
/// position.
using PoseBlock = std::array<double, kPoseUnknowns>;
using LensBlock = std::array<double, kLensUnknowns>;

/// Rodrigues' rotation by the rotation part of a block.
Eigen::Matrix3d rotation_by(const double* block);

inline constexpr double kNearest = 1e-6;  // minimum distance in front of a camera, metres

/// The residuals of one corner in standard deviations of its noise, and their derivatives by the unknowns.
/// Rotations are relative to the linearisation point, so their three angles are small and have no
/// singularity. The derivatives are written by hand: automatic differentiation, with 21 unknowns each, took
/// more than half of a calibration's time.
struct CornerEquations {
  const Eigen::Matrix3d* camera_rotation;  ///< camera_from_world
  const Eigen::Matrix3d* board_rotation;   ///< world_from_board
  Eigen::Vector3d corner;                  ///< board
  Eigen::Vector2d pixel;
  double weight;  ///< per pixel

  struct Slopes {
    Eigen::Matrix<double, 2, kLensUnknowns, Eigen::RowMajor> lens;
    Eigen::Matrix<double, 2, kPoseUnknowns, Eigen::RowMajor> camera;
    Eigen::Matrix<double, 2, kPoseUnknowns, Eigen::RowMajor> board;
  };

  /// For the parameters in the blocks; false if the corner isn't in front of the camera. `slopes`
  /// (derivatives) may be null.
  bool operator()(const double* lens, const double* camera, const double* board, double* residuals,
                  Slopes* slopes) const;
};

}  // namespace emberlock::recon
