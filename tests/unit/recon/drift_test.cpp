// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/drift.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "tests/support/board_rig.h"

namespace emberlock::recon {
namespace {
using testing::HasSubstr;

constexpr double kDegree = M_PI / 180;

test::BoardRigOptions later_views(std::uint64_t seed) {
  test::BoardRigOptions options;
  options.cameras = 4;
  options.instants = 10;
  options.seed = seed;
  options.board = {BoardKind::chessboard, 9, 6, Meters(0.018)};
  return options;
}

TEST(DriftSlow, ARigThatStoodStillHolds) {
  for (const std::uint64_t seed : {1, 2}) {
    const test::BoardRig rig = test::board_rig(later_views(seed));
    const auto report = check_drift(test::rig_file_of(rig), rig.sightings, "rig.json");
    ASSERT_TRUE(report.ok()) << report.error().message();
    EXPECT_FALSE(report->drifted()) << seed;
    EXPECT_LT(report->rms_before, 0.35);
    for (const CameraDrift& camera : report->cameras)
      EXPECT_EQ(camera.verdict, DriftVerdict::still) << camera.id;
  }
}

TEST(DriftSlow, TheCameraThatWasKnockedIsNamedWithItsMotion) {
  const test::BoardRig rig = test::board_rig(later_views(3));
  v1::Rig file = test::rig_file_of(rig);
  const Eigen::Vector3d aside(1e-3, 0, 0);
  test::knock(file, rig, 2, {aside, {0, 0.5 * kDegree, 0}});
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

/// By its own calibration, whose turns are five times as uncertain as its rays.
TEST(DriftSlow, AFoundRigsSmallTurnIsNamedAndNoNeighbour) {
  test::BoardRigOptions options;
  options.cameras = 5;
  options.instants = 52;
  options.board = {BoardKind::chessboard, 9, 6, Meters(0.022)};
  test::BoardRig rig = test::board_rig(options);
  BoardSightings before = rig.sightings;
  std::erase_if(before.sightings, [](const auto& s) { return s.instant >= 40; });
  std::erase_if(rig.sightings.sightings, [](const auto& s) { return s.instant < 40; });
  const auto found = calibrate_rig(before, {.world = "0"});
  ASSERT_TRUE(found.ok() && found->whole());
  EXPECT_GT(found->cameras[2].sigma.tail<3>().maxCoeff(), 0.05 * kDegree);
  v1::Rig file = rig_of(*found, "");
  const auto still = check_drift(file, rig.sightings, "rig.json");
  ASSERT_TRUE(still.ok()) << still.error().message();
  EXPECT_FALSE(still->drifted());
  test::BoardRig believed = rig;
  for (std::size_t c = 0; c < 5; ++c) believed.cameras[c] = found->bundle.cameras[c].model;
  test::knock(file, believed, 2, {.turn = {0, 0.1 * kDegree, 0}});
  const auto turned = check_drift(file, rig.sightings, "rig.json");
  ASSERT_TRUE(turned.ok()) << turned.error().message();
  for (std::size_t c = 0; c < 5; ++c)
    EXPECT_EQ(turned->cameras[c].verdict, c == 2 ? DriftVerdict::moved : DriftVerdict::still) << c;
  EXPECT_LT(turned->cameras[2].turn_sigma, 0.05 * kDegree);
}

TEST(DriftSlow, AChangedZoomIsTheLenss) {
  const test::BoardRig rig = test::board_rig(later_views(4));
  v1::Rig file = test::rig_file_of(rig);
  v1::Calibration& c = *file.mutable_cameras(1)->mutable_calibration();
  c.set_k1(c.k1() + 0.3);
  const auto report = check_drift(file, rig.sightings, "rig.json");
  ASSERT_TRUE(report.ok()) << report.error().message();
  EXPECT_EQ(report->cameras[1].verdict, DriftVerdict::lens);
  EXPECT_THAT(report->cameras[1].why, HasSubstr("zoom or focus"));
}

TEST(DriftSlow, ARigThatDoesntFitIsAnError) {
  const test::BoardRig rig = test::board_rig(later_views(5));
  v1::Rig file = test::rig_file_of(rig);
  file.mutable_cameras(1)->set_width(1280);
  const auto other_size = check_drift(file, rig.sightings, "rig.json");
  ASSERT_FALSE(other_size.ok());
  EXPECT_THAT(other_size.error().message(), HasSubstr("1280 x 480"));
  EXPECT_THAT(other_size.error().message(), HasSubstr("640 x 480"));
  file.mutable_cameras(1)->set_camera_id("other");
  EXPECT_THAT(check_drift(file, rig.sightings, "rig.json").error().message(),
              HasSubstr("knows no camera cam01"));
}

test::BoardRig lamp_rig(int cameras, std::uint64_t seed) {
  test::BoardRigOptions options;
  options.cameras = cameras;
  options.instants = 1;  // its board alone is the world
  options.seed = seed;
  options.board = {BoardKind::chessboard, 9, 6, Meters(0.018)};
  return test::board_rig(options);
}

TEST(LampDriftSlow, StillRigsHoldAndTheCameraThatTurnedIsNamed) {
  int false_alarms = 0;
  for (std::uint64_t seed = 1; seed <= 30; ++seed) {
    const test::BoardRig rig = lamp_rig(6, seed);
    const auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, 5, seed), 0.3, seed);
    v1::Rig file = test::rig_file_of(rig);
    const auto still = check_drift(file, lamps, "rig.json");
    ASSERT_TRUE(still.ok()) << still.error().message();
    false_alarms += still->drifted() ? 1 : 0;
    test::knock(file, rig, 4, {.turn = {0, 0.2 * kDegree, 0}});
    const auto turned = check_drift(file, lamps, "rig.json");
    ASSERT_TRUE(turned.ok()) << turned.error().message();
    for (std::size_t c = 0; c < 6; ++c)
      EXPECT_EQ(turned->cameras[c].verdict, c == 4 ? DriftVerdict::moved : DriftVerdict::still)
          << "camera " << c << " of rig " << seed;
    EXPECT_FALSE(turned->cameras[4].turn_alone);
    EXPECT_EQ(turned->cameras[4].freedom, 6);
    EXPECT_GT(turned->rms_before, turned->rms_after);
  }
  EXPECT_EQ(false_alarms, 0) << "one in a thousand is meant";
}

TEST(LampDriftSlow, OnePlaceTellsOnlyATurn) {
  const test::BoardRig rig = lamp_rig(6, 7);
  const auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, 1, 7), 0.3, 7);
  v1::Rig file = test::rig_file_of(rig);
  const auto still = check_drift(file, lamps, "rig.json");
  ASSERT_TRUE(still.ok()) << still.error().message();
  EXPECT_FALSE(still->drifted());
  test::knock(file, rig, 1, {.turn = {0, 0.5 * kDegree, 0}});
  const auto turned = check_drift(file, lamps, "rig.json");
  ASSERT_TRUE(turned.ok()) << turned.error().message();
  const CameraDrift& camera = turned->cameras[1];
  EXPECT_EQ(camera.verdict, DriftVerdict::moved);
  EXPECT_TRUE(camera.turn_alone);
  EXPECT_EQ(camera.freedom, 2) << "the turn about the lamp's ray shows nothing";
  EXPECT_EQ(camera.place.norm(), 0);
  EXPECT_NEAR(camera.turn.norm() * 180 / M_PI, 0.5, 0.15);
  for (const std::size_t c : {0U, 2U, 3U, 4U, 5U}) EXPECT_EQ(turned->cameras[c].verdict, DriftVerdict::still);
}

TEST(LampDriftSlow, TwoCamerasTellThatOneOfThemMoved) {
  for (const int places : {1, 4, 8}) {
    const test::BoardRig rig = lamp_rig(2, 3);
    const auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, places, 3), 0.2, 3);
    v1::Rig file = test::rig_file_of(rig);
    const auto still = check_drift(file, lamps, "rig.json");
    ASSERT_TRUE(still.ok()) << still.error().message();
    EXPECT_FALSE(still->drifted()) << places;
    EXPECT_TRUE(still->one_of_two);
    EXPECT_EQ(still->cameras[0].turn_alone, places < 6) << "an equation a place";
    test::knock(file, rig, 1, {.turn = {0.5 * kDegree, 0, 0}});
    const auto turned = check_drift(file, lamps, "rig.json");
    ASSERT_TRUE(turned.ok()) << turned.error().message();
    EXPECT_TRUE(turned->drifted()) << places;
  }
}

TEST(LampDriftSlow, ALampThatNoTwoCamerasSeeIsAnError) {
  const test::BoardRig rig = lamp_rig(3, 2);
  auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, 3, 2), 0.2, 2);
  std::erase_if(lamps.sightings, [](const auto& s) { return s.camera != s.instant; });
  const auto report = check_drift(test::rig_file_of(rig), lamps, "rig.json");
  ASSERT_FALSE(report.ok());
  EXPECT_THAT(report.error().message(), HasSubstr("no two calibrated cameras see the lamp"));
}

}  // namespace
}  // namespace emberlock::recon
