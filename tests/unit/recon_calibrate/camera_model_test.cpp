// SPDX-License-Identifier: Apache-2.0
#include "recon/views/camera_model.h"

#include <cmath>

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>

#include "recon/calibrate/pose.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

const Intrinsics kLens{{640, 480}, 500, 510, 320, 240, {}};

TEST(CameraModel, TheMiddleOfTheFirstPixelIsAtOneHalf) {
  // A lens whose axis meets the picture's corner: a point on the axis lies at the corner of the first pixel,
  // and half a pixel to the right and down lies its middle.
  const CameraModel camera{{{640, 480}, 500, 500, 0, 0, {}}, {}};
  EXPECT_EQ(camera.project({0, 0, 2}), Eigen::Vector2d(0, 0));
  EXPECT_TRUE(camera.project({0.5 * 2 / 500, 0.5 * 2 / 500, 2}).isApprox(Eigen::Vector2d(0.5, 0.5)));
}

TEST(CameraModel, LookAtPutsTheTargetInTheMiddleAndUpOnTop) {
  const CameraModel camera = look_at(kLens, {0.3, -0.2, 0.1}, {0.01, 0.02, 0.03});
  EXPECT_TRUE(camera.center().isApprox(Eigen::Vector3d(0.3, -0.2, 0.1), 1e-12));
  EXPECT_TRUE(camera.project({0.01, 0.02, 0.03}).isApprox(Eigen::Vector2d(320, 240), 1e-9));
  EXPECT_LT(camera.project({0.01, 0.02, 0.05}).y(), 240) << "up is towards row 0";
  const Eigen::Matrix3d r = camera.camera_from_world.rotation;
  EXPECT_TRUE((r * r.transpose()).isIdentity(1e-12));
  EXPECT_NEAR(r.determinant(), 1, 1e-12);
}

TEST(CameraModel, ProjectsAsOpenCvDoes) {
  const Distortion d{-0.21, 0.09, 0.0013, -0.0007, 0.02};
  CameraModel camera = look_at(kLens, {0.4, 0.1, 0.2}, {0, 0, 0});
  camera.intrinsics.distortion = d;
  const auto& r = camera.camera_from_world.rotation;
  const auto& t = camera.camera_from_world.translation;
  const cv::Matx33d rotation(r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2));
  cv::Vec3d rotation_vector;
  cv::Rodrigues(rotation, rotation_vector);
  const std::vector<cv::Point3d> points{{0, 0, 0}, {0.1, -0.05, 0.08}, {-0.1, 0.09, -0.1}};
  std::vector<cv::Point2d> pixels;
  cv::projectPoints(points, rotation_vector, cv::Vec3d(t.x(), t.y(), t.z()),
                    cv::Matx33d(500, 0, 320, 0, 510, 240, 0, 0, 1),
                    std::vector<double>{d.k1, d.k2, d.p1, d.p2, d.k3}, pixels);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d ours = camera.project({points[i].x, points[i].y, points[i].z});
    EXPECT_NEAR(ours.x(), pixels[i].x, 1e-6);
    EXPECT_NEAR(ours.y(), pixels[i].y, 1e-6);
  }
}

TEST(CameraModel, DistortionThatFoldsThePictureIsRecognised) {
  Intrinsics lens = kLens;
  EXPECT_TRUE(distortion_inverts(lens));
  lens.distortion.k1 = -0.2;
  EXPECT_TRUE(distortion_inverts(lens));
  lens.distortion.k1 = -2;
  EXPECT_FALSE(distortion_inverts(lens));
  lens.distortion.k1 = 1e300;
  EXPECT_FALSE(distortion_inverts(lens)) << "an overflow is no inverse";
}

TEST(Pose, AUniformScaleIsTakenOutOfARotation) {
  const Eigen::Matrix3d r = look_at(kLens, {1, 2, 3}, {0, 0, 0}).camera_from_world.rotation;
  const auto rotation = value_of(nearest_rotation(0.01 * r));
  EXPECT_TRUE(rotation.isApprox(r, 1e-12));
}

TEST(Pose, WhatIsNoRotationIsRefused) {
  const Eigen::Matrix3d one = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d m = one;
  m(2, 2) = 0;
  EXPECT_EQ(nearest_rotation(m).error().what, "is singular");
  m(2, 2) = NAN;
  EXPECT_EQ(nearest_rotation(m).error().what, "is not finite");
  m(2, 2) = -1;
  EXPECT_EQ(nearest_rotation(m).error().what, "mirrors the world");
  m(2, 2) = 1.05;
  EXPECT_FALSE(nearest_rotation(m).ok()) << "unequal scale";
  m = one;
  m(0, 1) = 0.1;
  EXPECT_FALSE(nearest_rotation(m).ok()) << "shear";
  m(0, 1) = 1e-4;
  EXPECT_TRUE(nearest_rotation(m).ok()) << "the file's rounding";
}

TEST(Pose, OpenGlLooksAlongMinusZAndHasYUp) {
  const Rigid3 camera_from_world = camera_from_world_of_opengl(Eigen::Matrix4d::Identity());
  const CameraModel camera{kLens, camera_from_world};
  EXPECT_TRUE(camera.project({0, 0, -1}).isApprox(Eigen::Vector2d(320, 240)));
  EXPECT_LT(camera.project({0, 0.1, -1}).y(), 240);
  EXPECT_GT(camera.project({0.1, 0, -1}).x(), 320);
}

}  // namespace
}  // namespace emberlock::recon
