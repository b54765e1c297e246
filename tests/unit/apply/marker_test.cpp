// SPDX-License-Identifier: Apache-2.0
// Markers in pictures with truth: over distances, tilts, focal lengths and lenses.
#include "apply/marker.h"

#include <cmath>

#include <gmock/gmock.h>

#include "apply/marker_pose.h"
#include "tests/support/marker_film.h"

namespace emberlock::apply {
namespace {

using test::before_plate;
using test::off_truth;
using test::Plate;
using test::usual_marker;
using testing::HasSubstr;

constexpr ImageSize kPicture{640, 480};

recon::Intrinsics table_lens(double focal, const recon::Distortion& distortion = {}) {
  return {kPicture, focal, focal, 318.3, 243.1, distortion};
}
const recon::Distortion kBarrel{-0.25, 0.08, 0.001, -0.0007, 0};
const recon::Distortion kPincushion{0.12, -0.05, 0, 0.001, 0};

std::array<float, 256> light_of_srgb() {
  std::array<float, 256> light{};
  for (std::size_t i = 0; i < 256; ++i) {
    const double v = static_cast<double>(i) / 255;
    light[i] = static_cast<float>(v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
  }
  return light;
}

TEST(MarkerTest, ReadsWhatMarkersAreCalled) {
  const Marker marker = parse_marker("aruco:dict_4x4_50:7:8cm").value();
  EXPECT_EQ(marker_words(marker), "aruco:4X4_50:7:80mm");
  EXPECT_EQ(marker_words(parse_marker("charuco:5x4:30mm:22mm:4x4_50").value()),
            "charuco:5x4:30mm:22mm:4X4_50");
  const std::pair<const char*, const char*> bad[] = {
      {"", "neither"},
      {"chessboard:9x6:25mm", "neither"},
      {"aruco:4X4_50:7", "too few parts"},
      {"aruco:4X4_50:7:80mm:1", "too many"},
      {"aruco:9X9_50:7:80mm", "no dictionary"},
      {"aruco:4X4_50:50:80mm", "0 to 49"},
      {"aruco:4X4_50:-1:80mm", "0 to 49"},
      {"aruco:4X4_50:7x:80mm", "0 to 49"},
      {"aruco:4X4_50:99999999999:80mm", "0 to 49"},
      {"aruco:4X4_50:7:80", "no length"},
      {"aruco:4X4_50:7:nanmm", "no length"},
      {"aruco:4X4_50:7:0mm", "no length"},
      {"charuco:5x4:30mm:40mm:4X4_50", "below that of a square"},
      {"charuco:30x30:30mm:20mm:4X4_50", "fewer markers"}};
  for (const auto& [text, what] : bad) {
    const auto read = parse_marker(text);
    ASSERT_FALSE(read.ok()) << text;
    EXPECT_THAT(read.error().what, HasSubstr(what)) << text;
    EXPECT_THAT(read.error().remedy, HasSubstr("aruco:DICTIONARY:NUMBER:EDGE"));
  }
}

struct Geometry {
  double focal, distance, tilt_degrees, turn_degrees;
  recon::Distortion distortion;
  double aside;  ///< of what is looked at from the marker, metres
};
recon::CameraModel camera_of(const Geometry& g) {
  const double tilt = g.tilt_degrees / 180 * M_PI;
  const double turn = g.turn_degrees / 180 * M_PI;
  const Eigen::Vector3d from = g.distance * Eigen::Vector3d(std::sin(tilt) * std::cos(turn),
                                                            std::sin(tilt) * std::sin(turn), std::cos(tilt));
  const recon::CameraModel camera = recon::look_at(
      table_lens(g.focal, g.distortion), from, {g.aside, g.aside / 2, 0},
      std::abs(std::sin(turn)) > 0.9 && g.tilt_degrees > 1 ? Eigen::Vector3d(Eigen::Vector3d::UnitX())
                                                           : Eigen::Vector3d(Eigen::Vector3d::UnitY()));
  return camera;
}

TEST(MarkerSlow, PosesReprojectWithinHalfAPixelOverAllGeometries) {
  const Marker marker = usual_marker();
  const Plate plate(marker);
  const auto light = light_of_srgb();
  double worst = 0;
  const std::vector<Geometry> all = {{600, 0.4, 0, 0, {}, 0},
                                     {600, 0.4, 30, 40, {}, 0},
                                     {600, 0.5, 60, 130, {}, 0.05},
                                     {600, 1.2, 20, 250, {}, 0.3},
                                     {600, 1.6, 45, 300, {}, -0.4},
                                     {400, 0.3, 50, 10, kBarrel, 0.15},
                                     {400, 0.5, 25, 200, kBarrel, 0.3},
                                     {350, 0.25, 35, 70, kBarrel, 0.1},
                                     {900, 1, 40, 330, kPincushion, -0.2},
                                     {1500, 2, 65, 20, {}, 0.1},
                                     {1500, 3, 30, 160, kPincushion, 0.3}};
  for (std::size_t g = 0; g < all.size(); ++g) {
    const recon::CameraModel camera = camera_of(all[g]);
    test::PlateLook look;
    look.noise = 3;
    look.seed = g + 1;
    const auto points = find_marker(plate.seen_by(camera, look).view(), marker, camera.intrinsics, &light);
    ASSERT_EQ(points.size(), 4U) << g;
    const auto poses = marker_poses(points, camera.intrinsics);
    ASSERT_FALSE(poses.empty()) << g;
    const double off = off_truth(marker, camera, poses.front().camera_from_marker);
    EXPECT_LT(off, 0.5) << g;
    worst = std::max(worst, off);
  }
  EXPECT_LT(worst, 0.25);
}

TEST(MarkerSlow, ABoardIsSeenWhereAPartOfItIsHidden) {
  const Marker marker = parse_marker("charuco:5x4:30mm:22mm:4X4_50").value();
  const Plate plate(marker);
  const recon::CameraModel camera = before_plate(table_lens(600, kBarrel), {0.12, -0.1, 0.35});
  test::PlateLook look;
  look.noise = 3;
  Image picture = plate.seen_by(camera, look);
  for (int part = 0; part < 2; ++part) {
    const auto points = find_marker(picture.view(), marker, camera.intrinsics);
    ASSERT_GE(points.size(), 6U);
    const auto poses = marker_poses(points, camera.intrinsics);
    ASSERT_FALSE(poses.empty());
    EXPECT_LT(off_truth(marker, camera, poses.front().camera_from_marker), 0.5);
    for (int y = 0; y < kPicture.height; ++y)  // its right third
      std::fill_n(picture.row_as<std::uint8_t>(y) + 3 * 360, 3 * 280, std::uint8_t{90});
  }
}

/// A rim that is cut too narrow must not be taken for the edge: the distance is right to 3 %, or nothing is
/// found.
TEST(MarkerSlow, ACutMarginLeavesTheDistance) {
  const Marker marker = usual_marker();
  const Plate plate(marker);
  int found = 0;
  int cases = 0;
  for (const double rim : {0.0, 0.4e-3, 0.8e-3, 1.2e-3, 1.6e-3, 2e-3, 3e-3, 6e-3, 13e-3}) {
    for (const double distance : {0.35, 0.7, 1.3}) {
      for (const double tilt : {0.0, 35.0}) {
        const recon::CameraModel camera = camera_of({800, distance, tilt, 20, {}, 0.03});
        test::PlateLook look;
        look.rim = rim;
        look.noise = 2;
        look.samples = 3;
        look.table = distance > 1 ? 0.05 : 0.3;  // as dark as the ink, or grey
        ++cases;
        const auto points = find_marker(plate.seen_by(camera, look).view(), marker, camera.intrinsics);
        if (points.empty()) continue;
        const auto poses = marker_poses(points, camera.intrinsics);
        ASSERT_FALSE(poses.empty());
        const double z = poses.front().camera_from_marker.translation.norm();
        EXPECT_NEAR(z / camera.camera_from_world.translation.norm(), 1, 0.03)
            << rim << ' ' << distance << ' ' << tilt;
        ++found;
      }
    }
  }
  EXPECT_GE(found, cases / 4) << "else little is tested";
}

TEST(MarkerTest, AMarkerOfAnyDictionaryMayBeWhiteOnBlack) {
  for (const auto& [words, light] :
       std::vector<std::pair<const char*, bool>>{{"aruco:4X4_50:7:80mm", true},
                                                 {"aruco:5X5_100:33:80mm", true},
                                                 {"aruco:6X6_250:200:80mm", false},
                                                 {"aruco:6X6_250:200:80mm", true},
                                                 {"aruco:7X7_250:33:80mm", false},
                                                 {"aruco:7X7_250:33:80mm", true},
                                                 {"aruco:ORIGINAL:500:80mm", true},
                                                 {"charuco:5x4:30mm:22mm:4X4_50", true},
                                                 {"charuco:5x4:30mm:26mm:6X6_250", true}}) {
    const Marker marker = parse_marker(words).value();
    const recon::CameraModel camera = before_plate(table_lens(600, kBarrel), {0.1, -0.08, 0.35});
    test::PlateLook look;
    if (light) std::swap(look.paper, look.ink);
    const Image picture = Plate(marker).seen_by(camera, look);
    const auto points = find_marker(picture.view(), marker, camera.intrinsics);
    ASSERT_FALSE(points.empty()) << words;
    EXPECT_LT(off_truth(marker, camera, marker_poses(points, camera.intrinsics).front().camera_from_marker),
              0.7)
        << words;
    const Image mirrored = recon::mirror_picture(picture.view());
    EXPECT_TRUE(find_marker(mirrored.view(), marker, camera.intrinsics).empty()) << words;
    EXPECT_TRUE(is_mirrored(mirrored.view(), marker, camera.intrinsics)) << words;
    EXPECT_FALSE(is_mirrored(picture.view(), marker, camera.intrinsics)) << words;
  }
}

TEST(MarkerTest, OfTwoPosesOneIsTheTruth) {
  const Marker marker = usual_marker();
  const recon::CameraModel camera = camera_of({600, 3, 35, 60, {}, 0.1});
  const auto poses = marker_poses(test::true_corners(marker, camera), camera.intrinsics);
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_LT((poses[0].camera_from_marker.rotation - camera.camera_from_world.rotation).norm(), 1e-6);
  EXPECT_LT(poses[1].rms, 0.5) << "from afar the other one is nearly as good";
  EXPECT_GT(poses[1].rms, poses[0].rms);
}

TEST(MarkerTest, TellsWhichMarkersThereAreInstead) {
  const Marker marker = parse_marker("aruco:5X5_100:3:80mm").value();
  const recon::CameraModel camera = before_plate(table_lens(600), {0.1, -0.1, 0.4});
  const Image picture = Plate(marker).seen_by(camera);
  EXPECT_TRUE(find_marker(picture.view(), usual_marker(), camera.intrinsics).empty());
  EXPECT_EQ(other_markers(picture.view(), camera.intrinsics), "a marker of 5X5_50, number 3");
  test::PlateLook bare;
  bare.hidden = true;
  EXPECT_EQ(other_markers(Plate(marker).seen_by(camera, bare).view(), camera.intrinsics), "");
}

TEST(MarkerTest, TwistsAndMotionsAreInverse) {
  for (const double size : {1e-9, 1e-3, 1.0, 2.5}) {
    Twist twist;
    twist << 0.3, -0.2, 0.5, 0.1 * size, 0.7 * size, -0.6 * size;
    EXPECT_LT((twist_of(rigid_of(twist)) - twist).norm(), 1e-9) << size;
  }
}

}  // namespace
}  // namespace emberlock::apply
