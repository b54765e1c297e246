// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/corner_cost.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::recon {
namespace {

/// A corner somewhere in front of a camera somewhere, all its unknowns other than 0.
struct CornerCase {
  Eigen::Matrix3d camera_rotation;
  Eigen::Matrix3d board_rotation;
  CornerEquations equations = {};
  std::array<double, kLensUnknowns + 2 * kPoseUnknowns> at = {};

  CornerCase(std::uint64_t seed, double turn) {
    RandomStream random(seed, 5);
    const auto any = [&](double reach) { return random.uniform(-reach, reach); };
    const auto rotation = [&] {
      return Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal())
          .normalized()
          .toRotationMatrix();
    };
    camera_rotation = rotation();
    board_rotation = rotation();
    equations = {
        &camera_rotation, &board_rotation, {any(0.1), any(0.1), any(0.1)}, {any(300), any(300)}, 2.5};
    at = {500,    510,       320,       240,       -0.2,      0.05,   2e-3,
          -1e-3,  0.02,      any(turn), any(turn), any(turn), any(1), any(1),
          any(1), any(turn), any(turn), any(turn), 0,         0,      0};
    // The board half a metre in front of the camera, somewhat aside.
    const Eigen::Vector3d in_front = camera_rotation.transpose() * Eigen::Vector3d(any(0.2), any(0.2), 0.5);
    for (std::size_t i = 0; i < 3; ++i) at[18 + i] = at[12 + i] + in_front[static_cast<Eigen::Index>(i)];
  }
  bool draw(Eigen::Vector2d& residuals, CornerEquations::Slopes* slopes) const {
    return equations(at.data(), &at[kLensUnknowns], &at[kLensUnknowns + kPoseUnknowns], residuals.data(),
                     slopes);
  }
};

TEST(CornerEquations, TheyDrawWhatTheCameraDraws) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    CornerCase corner(seed, 0);
    for (const std::size_t i : {9U, 10U, 11U, 15U, 16U, 17U}) corner.at[i] = 0;
    Eigen::Vector2d residuals;
    ASSERT_TRUE(corner.draw(residuals, nullptr));
    const auto& a = corner.at;
    CameraModel camera{
        {{640, 480}, a[0], a[1], a[2], a[3], {a[4], a[5], a[6], a[7], a[8]}},
        {corner.camera_rotation, -(corner.camera_rotation * Eigen::Vector3d(a[12], a[13], a[14]))}};
    const Eigen::Vector3d world =
        corner.board_rotation * corner.equations.corner + Eigen::Vector3d(a[18], a[19], a[20]);
    EXPECT_LT((2.5 * (camera.project(world) - corner.equations.pixel) - residuals).norm(), 1e-9);
  }
}

TEST(CornerEquations, TheirSlopesAreThoseOfSmallSteps) {
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    // Turns of no size, of the series' size, and of any.
    CornerCase corner(seed, seed % 3 == 0 ? 0 : seed % 3 == 1 ? 3e-5 : 0.3);
    CornerEquations::Slopes slopes;
    Eigen::Vector2d residuals;
    ASSERT_TRUE(corner.draw(residuals, &slopes));
    Eigen::Matrix<double, 2, kLensUnknowns + 2 * kPoseUnknowns> all;
    all << slopes.lens, slopes.camera, slopes.board;
    for (std::size_t i = 0; i < corner.at.size(); ++i) {
      CornerCase moved = corner;
      moved.equations.camera_rotation = &moved.camera_rotation;
      moved.equations.board_rotation = &moved.board_rotation;
      const double step = 1e-6 * std::max(1.0, std::abs(corner.at[i]));
      Eigen::Vector2d above;
      Eigen::Vector2d below;
      moved.at[i] = corner.at[i] + step;
      ASSERT_TRUE(moved.draw(above, nullptr));
      moved.at[i] = corner.at[i] - step;
      ASSERT_TRUE(moved.draw(below, nullptr));
      const Eigen::Vector2d slope = all.col(static_cast<Eigen::Index>(i));
      EXPECT_LT(((above - below) / (2 * step) - slope).norm(), 1e-6 * (10 + slope.norm()))
          << "unknown " << i << " of case " << seed;
    }
  }
}

TEST(CornerEquations, ACornerBehindTheCameraIsNone) {
  CornerCase corner(1, 0);
  for (std::size_t i = 0; i < 3; ++i) corner.at[18 + i] = 2 * corner.at[12 + i] - corner.at[18 + i];
  Eigen::Vector2d residuals;
  EXPECT_FALSE(corner.draw(residuals, nullptr));
}

}  // namespace
}  // namespace emberlock::recon
