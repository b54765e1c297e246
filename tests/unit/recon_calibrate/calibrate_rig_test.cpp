// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/calibrate_rig.h"

#include <cmath>

#include <gmock/gmock.h>

#include "recon/calibrate/next_pictures.h"
#include "recon/calibrate/pose.h"
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

/// Mirrors what a camera sees.
void mirror(BoardSightings& sightings, std::size_t camera) {
  for (auto& sighting : sightings.sightings)
    if (sighting.camera == camera)
      sighting.corners =
          test::mirrored_corners(sighting.corners, sightings.board, sightings.cameras[camera].size.width);
}

TEST(CalibrateRigSlow, MirroredCamerasAreNamedAndTheOthersSolvedWithoutThem) {
  struct Case {
    int cameras, instants;
    std::vector<std::size_t> mirrored, named;
  };
  const Case cases[] = {{2, 12, {1}, {1}}, {2, 12, {0}, {1}},       {2, 12, {0, 1}, {}},
                        {3, 16, {0}, {0}}, {5, 20, {1, 3}, {1, 3}}, {3, 16, {}, {}}};
  std::uint64_t seed = 1;
  for (const Case& c : cases) {
    test::BoardRigOptions options = small_rig(c.cameras, c.instants);
    options.seed = seed++;
    test::BoardRig rig = test::board_rig(options);
    for (const std::size_t camera : c.mirrored) mirror(rig.sightings, camera);
    const auto found = value_of(calibrate_rig(rig.sightings));
    std::vector<std::size_t> named;
    for (std::size_t i = 0; i < found.cameras.size(); ++i) {
      if (found.cameras[i].calibrated) continue;
      named.push_back(i);
      EXPECT_THAT(found.cameras[i].why, HasSubstr("mirror images"));
    }
    EXPECT_EQ(named, c.named) << testing::PrintToString(c.mirrored);
    EXPECT_EQ(found.whole(), c.named.empty());
    EXPECT_LT(rms_of(found.bundle), 0.5);
    for (const RigCalibration::Rejected& view : found.rejected)
      EXPECT_THAT(c.named, testing::Contains(rig.sightings.sightings[view.sighting].camera))
          << "views of sound cameras aren't blamed";
  }
}

TEST(CalibrateRig, CornersThatNoLensFitsAreRefused) {
  test::BoardRigOptions options = small_rig(2, 12);
  options.noise = 4;
  EXPECT_THAT(calibrate_rig(test::board_rig(options).sightings), FailsWith("no lens fits them"));
}

/// Boards that fill only the middle of the picture don't determine k2, nor must they.
TEST(CalibrateRigSlow, BoardsInTheMiddleGiveTheFocalLength) {
  int held = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    const Intrinsics lens{{640, 480}, 700, 700, 320, 240, {}};
    BoardSightings sightings;
    sightings.board = {BoardKind::chessboard, 9, 6, Meters(0.018)};
    sightings.cameras.push_back({"cam", lens.size});
    RandomStream random(seed, 5);
    for (std::size_t i = 0; i < 14; ++i) {
      const Eigen::Vector3d middle = sightings.board.point(sightings.board.corners() - 1) / 2;
      const Eigen::Vector3d from(random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), 0.8);
      const CameraModel camera =
          look_at(lens, middle + 0.6 * from.normalized(), middle, Eigen::Vector3d::UnitY());
      BoardSightings::Sighting view{0, i, "picture", {}};
      for (int id = 0; id < sightings.board.corners(); ++id) {
        view.corners.push_back({id, camera.project(sightings.board.point(id)) +
                                        0.15 * Eigen::Vector2d(random.normal(), random.normal())});
      }
      sightings.sightings.push_back(std::move(view));
      sightings.instants.push_back(std::to_string(i));
    }
    const auto found = value_of(calibrate_rig(sightings));
    const CalibratedCamera& camera = found.cameras[0];
    ASSERT_TRUE(camera.placed) << camera.why;
    EXPECT_NEAR(camera.fit.model.intrinsics.fx, 700, std::max(7.0, 3.5 * camera.sigma[0])) << seed;
    EXPECT_TRUE(distortion_inverts(camera.fit.model.intrinsics)) << seed;
    if (camera.fit.radial_terms == kUsualRadialTerms) continue;
    ++held;
    EXPECT_EQ(camera.fit.model.intrinsics.distortion.k2, 0);
    EXPECT_THAT(next_pictures(found), testing::Contains(HasSubstr("distortion further out is unknown")));
  }
  EXPECT_GT(held, 0) << "else nothing is tested";
}

TEST(CalibrateRig, TheSquareRootLaw) {
  EXPECT_DOUBLE_EQ(expected_factor(10, 30), 0.5);
  EXPECT_DOUBLE_EQ(expected_factor(0, 30), 1);
}

}  // namespace
}  // namespace emberlock::recon
