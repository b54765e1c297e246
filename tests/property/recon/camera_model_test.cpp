// SPDX-License-Identifier: Apache-2.0
#include "recon/views/camera_model.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "recon/calibrate/pose.h"
#include "tests/support/properties.h"

namespace emberlock::recon {
namespace {

using test::law;

double real(double low, double high) {
  return low + (high - low) * *rc::gen::resize(rc::kNominalSize, rc::gen::inRange(0, 1 << 30)) /
                   static_cast<double>(1 << 30);
}
Eigen::Vector3d point(double extent) {
  return {real(-extent, extent), real(-extent, extent), real(-extent, extent)};
}
Eigen::Matrix3d rotation() {
  const Eigen::Quaterniond q(real(0.1, 1), real(-1, 1), real(-1, 1), real(-1, 1));
  return q.normalized().toRotationMatrix();
}
CameraModel camera() {
  const Intrinsics lens{
      {640, 480},
      real(600, 900),
      real(600, 900),
      real(280, 360),
      real(200, 280),
      {real(-0.15, 0.15), real(-0.05, 0.05), real(-0.003, 0.003), real(-0.003, 0.003), real(-0.01, 0.01)}};
  CameraModel model{lens, {rotation(), point(2)}};
  RC_PRE(distortion_inverts(lens));
  return model;
}

TEST(CameraModelLaws, ARayProjectsBackOntoItsPixel) {
  law("project(ray(pixel)) == pixel", [] {
    const CameraModel c = camera();
    const Eigen::Vector2d pixel(real(0, 640), real(0, 480));
    const Ray ray = c.ray(pixel);
    RC_ASSERT(std::abs(ray.direction.norm() - 1) < 1e-12);
    const Eigen::Vector2d back = c.project(ray.origin + real(0.01, 100) * ray.direction);
    RC_ASSERT((back - pixel).norm() < 1e-9);
  });
}

TEST(CameraModelLaws, ARotatedSceneGivesTheSamePixels) {
  law("rotating world and camera alike changes nothing", [] {
    const CameraModel c = camera();
    const Rigid3 turned_from_world{rotation(), point(3)};
    CameraModel turned = c;
    const Rigid3 world_from_turned = turned_from_world.inverse();
    turned.camera_from_world = {c.camera_from_world.rotation * world_from_turned.rotation,
                                c.camera_from_world * world_from_turned.translation};
    const Eigen::Vector3d p =
        c.camera_from_world.inverse() * Eigen::Vector3d(real(-0.3, 0.3), real(-0.3, 0.3), real(0.5, 2));
    RC_ASSERT((c.project(p) - turned.project(turned_from_world * p)).norm() < 1e-8);
  });
}

TEST(CameraModelLaws, OpenGlAndOpenCvPosesConvertBothWays) {
  law("to OpenGL and back is the identity", [] {
    const Rigid3 pose{rotation(), point(5)};
    const Rigid3 back = camera_from_world_of_opengl(opengl_world_from_camera(pose));
    RC_ASSERT(back.rotation.isApprox(pose.rotation, 1e-12));
    RC_ASSERT((back.translation - pose.translation).norm() < 1e-12);
  });
  law("the matrix's last column is where the camera stands, its third looks backward", [] {
    const Rigid3 pose{rotation(), point(5)};
    const Eigen::Matrix4d m = opengl_world_from_camera(pose);
    const CameraModel c{{{2, 2}, 1, 1, 1, 1, {}}, pose};
    RC_ASSERT((Eigen::Vector3d(m.block<3, 1>(0, 3)) - c.center()).norm() < 1e-12);
    RC_ASSERT((c.ray({1, 1}).direction + Eigen::Vector3d(m.block<3, 1>(0, 2))).norm() < 1e-12);
  });
}

TEST(CameraModelLaws, TheNearestRotationOfARotationIsItself) {
  law("nearest_rotation(s R) == R", [] {
    const Eigen::Matrix3d r = rotation();
    const auto nearest = nearest_rotation(real(1e-3, 1e3) * r);
    RC_ASSERT(nearest.ok());
    RC_ASSERT(nearest->isApprox(r, 1e-9));
  });
}

}  // namespace
}  // namespace emberlock::recon
