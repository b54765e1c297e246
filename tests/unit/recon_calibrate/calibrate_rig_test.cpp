// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/calibrate_rig.h"

#include <cmath>

#include <gmock/gmock.h>

#include "recon/calibrate/next_pictures.h"
#include "tests/support/pose_errors.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
using testing::HasSubstr;

test::BoardRigOptions small_rig(int cameras, int instants) {
  test::BoardRigOptions options;
  options.cameras = cameras;
  options.instants = instants;
  options.board = {BoardKind::chessboard, 9, 6, Meters(0.022)};
  return options;
}

void keep(BoardSightings& sightings, auto wanted) {
  std::erase_if(sightings.sightings, [&](const BoardSightings::Sighting& s) { return !wanted(s); });
}

TEST(CalibrateRigSlow, ARingWithWrongCornersIsFoundAndItsUncertaintiesAreRight) {
  test::BoardRigOptions options = small_rig(6, 26);
  const test::BoardRig rig = test::board_rig(options);
  const auto found = value_of(calibrate_rig(rig.sightings, {.world = "0"}));
  ASSERT_TRUE(found.whole());
  const test::PoseErrors among = test::errors_among_cameras(found, rig.cameras);
  EXPECT_LT(among.place, 1.5e-3);
  EXPECT_LT(among.rays, 0.15 * M_PI / 180);
  const test::PoseErrors world = test::errors_in_world(found, rig.cameras);
  // 99.98 % of chi-square with 36 degrees of freedom.
  EXPECT_GT(world.chi2, 12.0);
  EXPECT_LT(world.chi2, 74.0);
  for (const CalibratedCamera& camera : found.cameras) {
    EXPECT_NEAR(camera.fit.noise, 0.2, 0.02);
    const auto outliers = static_cast<double>(camera.corners - camera.corners_used);
    EXPECT_NEAR(outliers / static_cast<double>(camera.corners), 0.05, 0.025)
        << "the wrong ones, and they alone";
  }
  ASSERT_TRUE(found.box) << "all look at one place";
  EXPECT_GT(found.box->size.x(), 0.03);
}

TEST(CalibrateRig, ExactCornersGiveTheExactRig) {
  test::BoardRigOptions options = small_rig(3, 14);
  options.noise = 0;
  options.wrong = 0;
  const test::BoardRig rig = test::board_rig(options);
  const auto found = value_of(calibrate_rig(rig.sightings, {.world = "0"}));
  const test::PoseErrors world = test::errors_in_world(found, rig.cameras);
  EXPECT_LT(world.place, 2e-6);
  EXPECT_LT(world.turn, 2e-5);
}

TEST(CalibrateRig, ViewsThatDontFitAreNamed) {
  test::BoardRig rig = test::board_rig(small_rig(3, 12));
  auto& bad = rig.sightings.sightings[4];
  for (BoardCorner& corner : bad.corners)
    corner.pixel += Eigen::Vector2d(5.0 * (corner.id % 2), 3.0 * (corner.id % 3));
  const auto found = value_of(calibrate_rig(rig.sightings));
  ASSERT_EQ(found.rejected.size(), 1U);
  EXPECT_EQ(found.rejected[0].sighting, 4U);
  EXPECT_FALSE(found.rejected[0].why.empty());
}

TEST(CalibrateRig, ACameraThatSharesNoInstantHasALensAndIsNamed) {
  test::BoardRig rig = test::board_rig(small_rig(3, 14));
  // Camera 2 is alone at its instants: give its views instants of their own.
  for (auto& sighting : rig.sightings.sightings) {
    if (sighting.camera != 2) continue;
    sighting.instant = rig.sightings.instants.size();
    rig.sightings.instants.push_back("alone " + std::to_string(sighting.instant));
  }
  const auto found = value_of(calibrate_rig(rig.sightings));
  EXPECT_FALSE(found.whole());
  EXPECT_TRUE(found.cameras[0].placed);
  EXPECT_TRUE(found.cameras[2].calibrated);
  EXPECT_FALSE(found.cameras[2].placed);
  EXPECT_THAT(found.cameras[2].why, HasSubstr("shares no usable instant"));
  EXPECT_THAT(next_pictures(found), testing::Contains(HasSubstr("cam02: shares no usable instant")));
  const v1::Rig written = rig_of(found, "");
  EXPECT_EQ(written.cameras(2).calibration().camera_from_world_size(), 0);
  EXPECT_EQ(written.cameras(0).calibration().sigma_size(), 15 + 21);
}

TEST(CalibrateRig, TooFewViewsSayHowManyAndWhatToDo) {
  test::BoardRig rig = test::board_rig(small_rig(2, 4));
  rig.sightings.sightings.clear();
  EXPECT_THAT(calibrate_rig(rig.sightings), FailsWith("found in no picture"));
  test::BoardRigOptions two = small_rig(2, 12);
  BoardSightings few = test::board_rig(two).sightings;
  keep(few, [](const auto& s) { return s.instant < 2; });
  EXPECT_THAT(calibrate_rig(few), FailsWith("at least 3"));
}

TEST(CalibrateRig, ParallelBoardsAreRefused) {
  const Intrinsics lens{{640, 480}, 550, 550, 320, 240, {}};
  BoardSightings sightings;
  sightings.cameras.push_back({"cam", lens.size});
  RandomStream random(3, 3);
  for (std::size_t i = 0; i < 6; ++i) {
    const CameraModel camera{
        lens,
        {Eigen::DiagonalMatrix<double, 3>(1, -1, -1).toDenseMatrix(),
         {random.uniform(-0.15, 0.0), random.uniform(-0.05, 0.1), random.uniform(0.3, 0.5)}}};
    BoardSightings::Sighting view{0, i, "picture", {}};
    for (int id = 0; id < sightings.board.corners(); ++id) {
      view.corners.push_back({id, camera.project(sightings.board.point(id)) +
                                      0.1 * Eigen::Vector2d(random.normal(), random.normal())});
    }
    sightings.sightings.push_back(std::move(view));
    sightings.instants.push_back(std::to_string(i));
  }
  const auto found = calibrate_rig(sightings);
  ASSERT_FALSE(found.ok()) << "focal length " << found->cameras[0].fit.model.intrinsics.fx;
  EXPECT_THAT(found, FailsWith("tilted"));
}

TEST(CalibrateRig, TheWorldMustBeAnInstantThatWasUsed) {
  const test::BoardRig rig = test::board_rig(small_rig(2, 8));
  EXPECT_THAT(calibrate_rig(rig.sightings, {.world = "nowhere"}), FailsWith("--world nowhere"));
}

TEST(CalibrateRig, ABoardThatLooksTheSameUpsideDownIsRefusedForSeveralCameras) {
  BoardSightings sightings = test::board_rig(small_rig(2, 4)).sightings;
  sightings.board.columns = 10;
  EXPECT_THAT(calibrate_rig(sightings), FailsWith("upside down"));
}

TEST(CalibrateRig, TheSquareRootLaw) {
  EXPECT_DOUBLE_EQ(expected_factor(10, 30), 0.5);
  EXPECT_DOUBLE_EQ(expected_factor(0, 30), 1);
}

}  // namespace
}  // namespace emberlock::recon
