#pragma once

#include <array>

#include <Eigen/Core>
#include <ceres/rotation.h>

#include "recon/calibrate/bundle.h"
#include "recon/kernels/lens.h"

namespace emberlock {

/// A pose's block: a turn (angle times axis) on top of where it was linearised, and a place.
using PoseBlock = std::array<double, kPoseUnknowns>;
using LensBlock = std::array<double, kLensUnknowns>;

inline constexpr double kNearest = 1e-6;  // metres in front of a camera

/// One corner: residuals in standard deviations of its noise. Poses turn about where they were linearised, so
/// their three angles are small and have no singularity.
struct CornerCost {
  const Eigen::Matrix3d* camera_rotation;  ///< camera_from_world
  const Eigen::Matrix3d* board_rotation;   ///< world_from_board
  Eigen::Vector3d corner;                  ///< board
  Eigen::Vector2d pixel;
  double weight;

  template <class T>
  bool operator()(const T* lens, const T* camera, const T* board, T* out) const {
    using Vector = Eigen::Matrix<T, 3, 1>;
    const Vector turned = (*board_rotation * corner).template cast<T>();
    Vector world;
    ceres::AngleAxisRotatePoint(board, turned.data(), world.data());
    for (int a = 0; a < 3; ++a) world[a] += board[3 + a] - camera[3 + a];
    const Vector straight = camera_rotation->template cast<T>() * world;
    Vector p;
    ceres::AngleAxisRotatePoint(camera, straight.data(), p.data());
    if (!(p[2] > T(kNearest))) return false;
    T x;
    T y;
    brown_conrady(lens[4], lens[5], lens[6], lens[7], lens[8], T(p[0] / p[2]), T(p[1] / p[2]), x, y);
    out[0] = weight * (lens[0] * x + lens[2] - pixel.x());
    out[1] = weight * (lens[1] * y + lens[3] - pixel.y());
    return true;
  }
};

}  // namespace emberlock
