#include "recon/calibrate/drift.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "tests/support/board_rig.h"

namespace emberlock {
namespace {
using testing::HasSubstr;

test::BoardRigOptions later_views(std::uint64_t seed) {
  test::BoardRigOptions options;
  options.cameras = 4;
  options.instants = 10;
  options.seed = seed;
  options.board = {BoardKind::chessboard, 9, 6, Meters(0.018)};
  return options;
}

/// The truth as a rig's file, with what a good calibration would state.
v1::Rig calibrated(const test::BoardRig& rig) {
  v1::Rig file;
  file.set_format_version(1);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    v1::RigCamera& camera = *file.add_cameras();
    camera.set_camera_id(rig.sightings.cameras[c].id);
    camera.set_width(640);
    camera.set_height(480);
    *camera.mutable_calibration() = calibration_of(rig.cameras[c]);
    for (int i = 0; i < 15; ++i) camera.mutable_calibration()->add_sigma(i < 12 ? 1e-4 : 2e-4);
    camera.mutable_calibration()->set_corner_sigma(0.2);
  }
  return file;
}

TEST(Drift, ARigThatStoodStillHolds) {
  for (const std::uint64_t seed : {1, 2}) {
    const test::BoardRig rig = test::board_rig(later_views(seed));
    const auto report = check_drift(calibrated(rig), rig.sightings, "rig.json");
    ASSERT_TRUE(report.ok()) << report.error().message();
    EXPECT_FALSE(report->drifted()) << seed;
    EXPECT_LT(report->rms_before, 0.35);
    for (const CameraDrift& camera : report->cameras)
      EXPECT_EQ(camera.verdict, DriftVerdict::still) << camera.id;
  }
}

TEST(Drift, TheCameraThatWasKnockedIsNamedWithItsMotion) {
  const test::BoardRig rig = test::board_rig(later_views(3));
  v1::Rig file = calibrated(rig);
  CameraModel before = rig.cameras[2];  // where it stood: 1 mm aside, 0.5 degrees turned
  const Eigen::Vector3d aside(1e-3, 0, 0);
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.5 * M_PI / 180, Eigen::Vector3d::UnitY()).toRotationMatrix();
  const Eigen::Vector3d center = before.center() - aside;
  before.camera_from_world.rotation = turn.transpose() * before.camera_from_world.rotation;
  before.camera_from_world.translation = -(before.camera_from_world.rotation * center);
  v1::Calibration& c = *file.mutable_cameras(2)->mutable_calibration();
  for (int i = 0; i < 12; ++i) c.set_camera_from_world(i, calibration_of(before).camera_from_world(i));
  const auto report = check_drift(file, rig.sightings, "rig.json");
  ASSERT_TRUE(report.ok()) << report.error().message();
  for (std::size_t i = 0; i < report->cameras.size(); ++i) {
    EXPECT_EQ(report->cameras[i].verdict, i == 2 ? DriftVerdict::moved : DriftVerdict::still) << i;
  }
  const CameraDrift& camera = report->cameras[2];
  EXPECT_NEAR((camera.place - aside).norm(), 0, 4 * camera.place_sigma);
  EXPECT_NEAR(camera.turn.norm() * 180 / M_PI, 0.5, 4 * camera.turn_sigma * 180 / M_PI);
  EXPECT_LT(camera.place_sigma, 0.5e-3);
  EXPECT_GT(report->rms_before, 2 * report->rms_after);
}

TEST(Drift, AChangedZoomIsTheLenss) {
  const test::BoardRig rig = test::board_rig(later_views(4));
  v1::Rig file = calibrated(rig);
  v1::Calibration& c = *file.mutable_cameras(1)->mutable_calibration();
  c.set_k1(c.k1() + 0.3);
  const auto report = check_drift(file, rig.sightings, "rig.json");
  ASSERT_TRUE(report.ok()) << report.error().message();
  EXPECT_EQ(report->cameras[1].verdict, DriftVerdict::lens);
  EXPECT_THAT(report->cameras[1].why, HasSubstr("zoom or focus"));
}

TEST(Drift, ARigThatDoesntFitIsAnError) {
  const test::BoardRig rig = test::board_rig(later_views(5));
  v1::Rig file = calibrated(rig);
  file.mutable_cameras(1)->set_width(1280);
  const auto other_size = check_drift(file, rig.sightings, "rig.json");
  ASSERT_FALSE(other_size.ok());
  EXPECT_THAT(other_size.error().message(), HasSubstr("1280 x 480"));
  EXPECT_THAT(other_size.error().message(), HasSubstr("640 x 480"));
  file.mutable_cameras(1)->set_camera_id("other");
  EXPECT_THAT(check_drift(file, rig.sightings, "rig.json").error().message(),
              HasSubstr("knows no camera cam01"));
}

}  // namespace
}  // namespace emberlock
