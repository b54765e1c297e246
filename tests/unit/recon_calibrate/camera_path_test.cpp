// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/camera_path.h"

#include <array>
#include <cmath>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

namespace emberlock::recon {
namespace {

constexpr ImageSize kSize{320, 200};

bool sees(const CameraModel& camera, const Eigen::Vector3d& point) {
  if (!((camera.camera_from_world * point).z() > 0)) return false;
  const Eigen::Vector2d at = camera.project(point);
  return at.x() >= 0 && at.y() >= 0 && at.x() <= kSize.width && at.y() <= kSize.height;
}

TEST(Orbit, SeesTheWholeBoxFromAllAroundWhateverIsUp) {
  const Box box{{1, -2, 0.5}, {0.2, 0.1, 0.6}};
  for (const Eigen::Vector3d& up :
       {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 0, 0)}) {
    Orbit options;
    options.frames = 12;
    options.elevation = 0.3;
    options.up = up;
    const std::vector<CameraModel> path = orbit(box, kSize, options);
    ASSERT_EQ(path.size(), 12U);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const CameraModel& camera : path) {
      const Eigen::Vector3d out = camera.center() - box.center;
      sum += out / 12;
      EXPECT_NEAR(out.norm(), (path[0].center() - box.center).norm(), 1e-12);
      EXPECT_NEAR(std::asin(out.normalized().dot(up)), 0.3, 1e-12) << "the elevation";
      EXPECT_LT((camera.project(box.center) - Eigen::Vector2d(160, 100)).norm(), 1e-9)
          << "looks at the middle";
      EXPECT_LT(camera.camera_from_world.rotation.row(1).dot(up), 0) << "up is upwards in the picture";
      for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d place =
            box.center + box.size.cwiseProduct(Eigen::Vector3d((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5,
                                                               (corner >> 2 & 1) - 0.5));
        EXPECT_TRUE(sees(camera, place));
      }
    }
    EXPECT_LT((sum - sum.dot(up) * up).norm(), 1e-12) << "even around the axis";
  }
}

TEST(PathThroughCameras, MeetsThemAndMovesOnArcsBetween) {
  const Eigen::Vector3d pivot(0.1, 0, 0.2);
  const auto at = [&](double azimuth, double distance) {
    return looking(pivot + distance * Eigen::Vector3d(std::cos(azimuth), std::sin(azimuth), 0), pivot,
                   Eigen::Vector3d::UnitZ(), {640, 400});
  };
  std::vector<CameraModel> cameras = {at(0, 1), at(1.2, 1), at(2, 2)};
  cameras[1].intrinsics.distortion.k1 = 0.1;
  const std::vector<CameraModel> path = through(cameras, pivot, kSize, 9);
  ASSERT_EQ(path.size(), 9U);
  for (std::size_t stop = 0; stop < 3; ++stop) {
    const CameraModel& here = path[4 * stop];
    EXPECT_LT((here.center() - cameras[stop].center()).norm(), 1e-12);
    EXPECT_TRUE(here.camera_from_world.rotation.isApprox(cameras[stop].camera_from_world.rotation, 1e-12));
    EXPECT_NEAR(here.intrinsics.fy, cameras[stop].intrinsics.fy / 2, 1e-12) << "half the size, the same view";
    EXPECT_EQ(here.intrinsics.distortion.k1, 0);
  }
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_NEAR((path[i].center() - pivot).norm(), 1, 1e-12) << "on the arc";
    EXPECT_LT((path[i].project(pivot) - Eigen::Vector2d(160, 100)).norm(), 1e-6);
    const Eigen::Vector3d out = path[i].center() - pivot;
    EXPECT_NEAR(std::atan2(out.y(), out.x()), 0.3 * static_cast<double>(i), 1e-12) << "evenly";
  }
  EXPECT_NEAR((path[6].center() - pivot).norm(), 1.5, 1e-12);
}

TEST(PathThroughCameras, KeepsThePivotInTheMiddleFromAboveAndBetweenOppositeOnes) {
  const Eigen::Vector3d pivot(0, 0.3, 0);
  const auto at = [&](double azimuth, double elevation) {
    const Eigen::Vector3d out(std::cos(azimuth) * std::cos(elevation),
                              std::sin(azimuth) * std::cos(elevation), std::sin(elevation));
    return looking(pivot + out, pivot, Eigen::Vector3d::UnitZ(), kSize);
  };
  for (const auto& ends :
       {std::array{at(0, 0.5), at(2.1, 0.5)}, std::array{at(0, 0), at(3.141592653589793, 0)}})
    for (const CameraModel& camera : through({ends[0], ends[1]}, pivot, kSize, 7)) {
      EXPECT_LT((camera.project(pivot) - Eigen::Vector2d(160, 100)).norm(), 1e-6);
      EXPECT_NEAR((camera.center() - pivot).norm(), 1, 1e-9);
      EXPECT_TRUE(camera.camera_from_world.rotation.isUnitary(1e-9));
    }
}

}  // namespace
}  // namespace emberlock::recon
