// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/board.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "recon/calibrate/carried_board.h"
#include "recon/calibrate/markers.h"
#include "tests/support/board_rig.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {

CameraModel watcher() {
  const Intrinsics lens{{320, 240}, 300, 300, 163, 118, {-0.1, 0.02, 5e-4, -5e-4, 0}};
  return look_at(lens, {0.02, -0.1, 0.28}, {0, 0, 0}, Eigen::Vector3d::UnitY());
}

/// The board's middle at the origin, turned by `angle` about its own normal.
Rigid3 turned_board(const Board& board, double angle) {
  const Eigen::Matrix3d rotation = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  return {rotation, -rotation * (0.5 * (board.point(0) + board.point(board.corners() - 1)))};
}

double worst_corner(const std::vector<BoardCorner>& corners, const Board& board, const CameraModel& camera,
                    const Rigid3& pose) {
  double worst = 0;
  for (const BoardCorner& corner : corners)
    worst = std::max(worst, (camera.project(pose * board.point(corner.id)) - corner.pixel).norm());
  return worst;
}

TEST(Board, ItsWordsSayItAll) {
  const auto chess = value_of(parse_board("chessboard:9x6:25mm"));
  EXPECT_EQ(chess.columns, 9);
  EXPECT_EQ(chess.rows, 6);
  EXPECT_DOUBLE_EQ(chess.square.value(), 0.025);
  EXPECT_FALSE(chess.ambiguous());
  const auto charuco = value_of(parse_board("charuco:11x8:3cm:22.5mm:DICT_5X5_100"));
  EXPECT_EQ(charuco.columns, 10) << "squares are given, corners are kept";
  EXPECT_EQ(board_words(charuco), "charuco:11x8:30mm:22.5mm:5X5_100");
  EXPECT_TRUE(parse_board("chessboard:8x6:25mm")->ambiguous());
}

TEST(Board, WhatIsNoBoardIsAnErrorWithTheFormat) {
  for (const char* text :
       {"", "chessboard", "chessboard:9x6", "chessboard:9:25mm", "chessboard:9x6:25", "chess:9x6:25mm",
        "chessboard:9x6:-3mm", "chessboard:1x6:25mm", "chessboard:9x6:25mm:3",
        "chessboard:9x999999999999:25mm", "charuco:11x8:30mm:31mm:5X5_100", "charuco:11x8:30mm:22mm:9X9_1",
        "charuco:20x20:30mm:22mm:4X4_50", "chessboard:9x6:nanmm"}) {
    EXPECT_THAT(parse_board(text), FailsWith("chessboard:9x6:25mm")) << text;
  }
}

TEST(Board, AChessboardsCornersAreFoundToAFractionOfAPixelFromAnySide) {
  const Board board = *parse_board("chessboard:9x6:18mm");
  for (const double angle : {0.0, 0.3, M_PI, M_PI / 2}) {
    const Rigid3 pose = turned_board(board, angle);
    const auto corners = find_board(board_picture(watcher(), board, pose).view(), board);
    ASSERT_EQ(corners.size(), 54U) << angle;
    EXPECT_LT(worst_corner(corners, board, watcher(), pose), 0.35)
        << "wrong ids are tens of pixels off: " << angle;
  }
}

/// The corners both of whose markers lie in the picture, 3 pixels from its edges at least: OpenCV takes a
/// corner by its two markers, and none that touches the edge. Markers fill the middles of the white squares,
/// and the first square is black.
std::vector<int> corners_with_markers(const Board& board, const CameraModel& camera, const Rigid3& pose) {
  const auto shown = [&](int column, int row) {
    const Eigen::Vector3d middle = board.square.value() * Eigen::Vector3d(column - 0.5, 0.5 - row, 0);
    const double half = 0.5 * board.marker.value();
    for (const auto& [x, y] : {std::pair(-half, -half), {half, -half}, {-half, half}, {half, half}}) {
      const Eigen::Vector2d pixel = camera.project(pose * (middle + Eigen::Vector3d(x, y, 0)));
      if (pixel.minCoeff() < 3 || pixel.x() > camera.intrinsics.size.width - 3 ||
          pixel.y() > camera.intrinsics.size.height - 3)
        return false;
    }
    return true;
  };
  std::vector<int> ids;
  for (int id = 0; id < board.corners(); ++id) {
    const int column = id % board.columns;
    const int row = id / board.columns;
    // Of the four squares around it the two white ones: (0, 0) is the black square before the first corner.
    const bool even = (column + row) % 2 == 0;
    if (even ? shown(column + 1, row) && shown(column, row + 1)
             : shown(column, row) && shown(column + 1, row + 1))
      ids.push_back(id);
  }
  return ids;
}

TEST(Board, PartOfACharucoBoardHasItsNumbers) {
  const Board board = *parse_board("charuco:9x7:22mm:16mm:5X5_100");
  CameraModel camera = watcher();
  camera.intrinsics.size = {640, 480};  // four pixels a marker's bit and more
  for (double* number :
       {&camera.intrinsics.fx, &camera.intrinsics.fy, &camera.intrinsics.cx, &camera.intrinsics.cy})
    *number *= 2;
  Rigid3 pose = turned_board(board, 0.2);
  pose.translation.x() += 0.12;  // a good part out of the picture
  const std::vector<int> visible = corners_with_markers(board, camera, pose);
  EXPECT_GE(visible.size(), 12U);
  EXPECT_LE(visible.size(), 36U) << "of 48";
  const auto corners = find_board(board_picture(camera, board, pose).view(), board);
  std::vector<int> found;
  found.reserve(corners.size());
  for (const BoardCorner& corner : corners) found.push_back(corner.id);
  EXPECT_THAT(found, testing::UnorderedElementsAreArray(visible));
  EXPECT_LT(worst_corner(corners, board, camera, pose), 0.4);
}

/// The picture with black and white exchanged.
Image negative_of(Image picture) {
  for (std::byte& level : picture.bytes()) level = ~level;
  return picture;
}

TEST(Board, ACharucoBoardMayBeWhiteOnBlack) {
  for (const char* words : {"charuco:7x5:24mm:17mm:5X5_100", "charuco:6x5:24mm:18mm:4X4_50"}) {
    const Board board = *parse_board(words);
    CameraModel camera = watcher();
    camera.intrinsics = {{640, 480}, 600, 600, 326, 236, {}};
    for (const double angle : {0.0, 0.4, M_PI}) {
      const Rigid3 pose = turned_board(board, angle);
      const Image picture = board_picture(camera, board, pose);
      const auto corners = find_board(negative_of(picture).view(), board);
      EXPECT_EQ(corners.size(), find_board(picture.view(), board).size()) << words << angle;
      EXPECT_LT(worst_corner(corners, board, camera, pose), 0.4) << words << angle;
    }
  }
}

TEST(Board, AMirroredCharucoBoardIsNamedAndAMirroredChessboardIsCountedAsOne) {
  const CameraModel camera = watcher();
  for (const char* words : {"charuco:6x5:24mm:18mm:4X4_50", "charuco:7x5:24mm:17mm:5X5_100"}) {
    CameraModel large = camera;
    large.intrinsics = {{640, 480}, 600, 600, 326, 236, {}};
    const Board board = *parse_board(words);
    const Image picture = board_picture(large, board, turned_board(board, 0.2));
    const Image mirrored = mirror_picture(picture.view());
    const BoardSearch search = search_for(board);
    EXPECT_FALSE(search.find_mirrored(picture.view()));
    EXPECT_TRUE(search.find(mirrored.view()).empty());
    EXPECT_TRUE(search.find_mirrored(mirrored.view()));
    EXPECT_TRUE(search.find_mirrored(negative_of(mirrored).view()));
  }
  for (const char* words : {"chessboard:9x6:18mm", "chessboard:6x9:18mm", "chessboard:8x5:18mm"}) {
    const Board board = *parse_board(words);
    EXPECT_FALSE(search_for(board).find_mirrored);
    const Rigid3 pose = turned_board(board, 0.2);
    const auto corners = find_board(mirror_picture(board_picture(camera, board, pose).view()).view(), board);
    ASSERT_EQ(corners.size(), static_cast<std::size_t>(board.corners())) << words;
    for (const BoardCorner& corner : test::mirrored_corners(corners, board, camera.intrinsics.size.width))
      EXPECT_LT((camera.project(pose * board.point(corner.id)) - corner.pixel).norm(), 0.5) << words;
  }
}

TEST(Board, ThereIsNoneInAnEmptyOrTinyPicture) {
  const Board board;
  for (const ImageSize size : {ImageSize{320, 240}, ImageSize{8, 8}}) {
    EXPECT_TRUE(find_board(Image(ImageLayout{size, PixelFormat::gray8, 8}).view(), board).empty());
    EXPECT_TRUE(find_board(Image(ImageLayout{size, PixelFormat::rgb16, 12}).view(), board).empty());
    EXPECT_TRUE(find_board(Image(ImageLayout{size, PixelFormat::bayer_rggb8, 8}).view(), board).empty());
  }
}

}  // namespace
}  // namespace emberlock::recon
