// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/drift.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "tests/support/board_rig.h"
#include "tests/support/results.h"

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

DriftReport drift_of(const v1::Rig& file, const auto& sightings) {
  return value_of(check_drift(file, sightings, "rig.json"));
}

/// Says of all but one camera that they stand still, and of that one that it moved.
void expect_moved(const DriftReport& report, std::size_t moved) {
  for (std::size_t c = 0; c < report.cameras.size(); ++c)
    EXPECT_EQ(report.cameras[c].verdict, c == moved ? DriftVerdict::moved : DriftVerdict::still) << c;
}

TEST(Drift, ARigThatStoodStillHolds) {
  for (const std::uint64_t seed : {1, 2}) {
    const test::BoardRig rig = test::board_rig(later_views(seed));
    const DriftReport report = drift_of(test::rig_file_of(rig), rig.sightings);
    EXPECT_FALSE(report.drifted()) << seed;
    EXPECT_LT(report.rms_before, 0.35);
    for (const CameraDrift& camera : report.cameras)
      EXPECT_EQ(camera.verdict, DriftVerdict::still) << camera.id;
  }
}

TEST(Drift, TheCameraThatWasKnockedIsNamedWithItsMotion) {
  const test::BoardRig rig = test::board_rig(later_views(3));
  v1::Rig file = test::rig_file_of(rig);
  const Eigen::Vector3d aside(1e-3, 0, 0);
  test::knock(file, rig, 2, {aside, {0, 0.5 * kDegree, 0}});
  const DriftReport report = drift_of(file, rig.sightings);
  expect_moved(report, 2);
  const CameraDrift& camera = report.cameras[2];
  EXPECT_NEAR((camera.place - aside).norm(), 0, 4 * camera.place_sigma);
  EXPECT_NEAR(camera.turn.norm() * 180 / M_PI, 0.5, 4 * camera.turn_sigma * 180 / M_PI);
  EXPECT_LT(camera.place_sigma, 0.5e-3);
  EXPECT_GT(report.rms_before, 2 * report.rms_after);
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
  EXPECT_FALSE(drift_of(file, rig.sightings).drifted());
  test::BoardRig believed = rig;
  for (std::size_t c = 0; c < 5; ++c) believed.cameras[c] = found->bundle.cameras[c].model;
  test::knock(file, believed, 2, {.turn = {0, 0.1 * kDegree, 0}});
  const DriftReport turned = drift_of(file, rig.sightings);
  expect_moved(turned, 2);
  EXPECT_LT(turned.cameras[2].turn_sigma, 0.05 * kDegree);
}

TEST(Drift, AChangedZoomIsTheLenss) {
  const test::BoardRig rig = test::board_rig(later_views(4));
  v1::Rig file = test::rig_file_of(rig);
  v1::Calibration& c = *file.mutable_cameras(1)->mutable_calibration();
  c.set_k1(c.k1() + 0.3);
  const DriftReport report = drift_of(file, rig.sightings);
  EXPECT_EQ(report.cameras[1].verdict, DriftVerdict::lens);
  EXPECT_THAT(report.cameras[1].why, HasSubstr("zoom or focus"));
}

TEST(Drift, ARigThatDoesntFitIsAnError) {
  const test::BoardRig rig = test::board_rig(later_views(5));
  v1::Rig file = test::rig_file_of(rig);
  file.mutable_cameras(1)->set_width(1280);
  EXPECT_THAT(check_drift(file, rig.sightings, "rig.json"), FailsWith("1280 x 480", "640 x 480"));
  file.mutable_cameras(1)->set_camera_id("other");
  EXPECT_THAT(check_drift(file, rig.sightings, "rig.json"), FailsWith("knows no camera cam01"));
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
    false_alarms += drift_of(file, lamps).drifted() ? 1 : 0;
    test::knock(file, rig, 4, {.turn = {0, 0.2 * kDegree, 0}});
    const DriftReport turned = drift_of(file, lamps);
    SCOPED_TRACE(seed);
    expect_moved(turned, 4);
    EXPECT_FALSE(turned.cameras[4].turn_alone);
    EXPECT_EQ(turned.cameras[4].freedom, 6);
    EXPECT_GT(turned.rms_before, turned.rms_after);
  }
  EXPECT_EQ(false_alarms, 0) << "one in a thousand is meant";
}

TEST(LampDrift, OnePlaceTellsOnlyATurn) {
  const test::BoardRig rig = lamp_rig(6, 7);
  const auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, 1, 7), 0.3, 7);
  v1::Rig file = test::rig_file_of(rig);
  EXPECT_FALSE(drift_of(file, lamps).drifted());
  test::knock(file, rig, 1, {.turn = {0, 0.5 * kDegree, 0}});
  const DriftReport turned = drift_of(file, lamps);
  expect_moved(turned, 1);
  const CameraDrift& camera = turned.cameras[1];
  EXPECT_TRUE(camera.turn_alone);
  EXPECT_EQ(camera.freedom, 2) << "the turn about the lamp's ray shows nothing";
  EXPECT_EQ(camera.place.norm(), 0);
  EXPECT_NEAR(camera.turn.norm() * 180 / M_PI, 0.5, 0.15);
}

TEST(LampDrift, TwoCamerasTellThatOneOfThemMoved) {
  for (const int places : {1, 4, 8}) {
    const test::BoardRig rig = lamp_rig(2, 3);
    const auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, places, 3), 0.2, 3);
    v1::Rig file = test::rig_file_of(rig);
    const DriftReport still = drift_of(file, lamps);
    EXPECT_FALSE(still.drifted()) << places;
    EXPECT_TRUE(still.one_of_two);
    EXPECT_EQ(still.cameras[0].turn_alone, places < 6) << "an equation a place";
    test::knock(file, rig, 1, {.turn = {0.5 * kDegree, 0, 0}});
    EXPECT_TRUE(drift_of(file, lamps).drifted()) << places;
  }
}

TEST(LampDrift, ALampThatNoTwoCamerasSeeIsAnError) {
  const test::BoardRig rig = lamp_rig(3, 2);
  auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, 3, 2), 0.2, 2);
  std::erase_if(lamps.sightings, [](const auto& s) { return s.camera != s.instant; });
  EXPECT_THAT(check_drift(test::rig_file_of(rig), lamps, "rig.json"),
              FailsWith("no two calibrated cameras see the lamp"));
}

}  // namespace
}  // namespace emberlock::recon
