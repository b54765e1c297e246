#include "recon/calibrate/board.h"

#include <cmath>

#include <Eigen/Geometry>
#include <gmock/gmock.h>

#include "tests/support/rendered_board.h"

namespace emberlock {
namespace {
using testing::HasSubstr;

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
  const auto chess = parse_board("chessboard:9x6:25mm");
  ASSERT_TRUE(chess.ok()) << chess.error().message();
  EXPECT_EQ(chess->columns, 9);
  EXPECT_EQ(chess->rows, 6);
  EXPECT_DOUBLE_EQ(chess->square.value(), 0.025);
  EXPECT_FALSE(chess->ambiguous());
  const auto charuco = parse_board("charuco:11x8:3cm:22.5mm:DICT_5X5_100");
  ASSERT_TRUE(charuco.ok()) << charuco.error().message();
  EXPECT_EQ(charuco->columns, 10) << "squares are given, corners are kept";
  EXPECT_EQ(board_words(*charuco), "charuco:11x8:30mm:22.5mm:5X5_100");
  EXPECT_TRUE(parse_board("chessboard:8x6:25mm")->ambiguous());
}

TEST(Board, WhatIsNoBoardIsAnErrorWithTheFormat) {
  for (const char* text :
       {"", "chessboard", "chessboard:9x6", "chessboard:9:25mm", "chessboard:9x6:25", "chess:9x6:25mm",
        "chessboard:9x6:-3mm", "chessboard:1x6:25mm", "chessboard:9x6:25mm:3",
        "chessboard:9x999999999999:25mm", "charuco:11x8:30mm:31mm:5X5_100", "charuco:11x8:30mm:22mm:9X9_1",
        "charuco:20x20:30mm:22mm:4X4_50", "chessboard:9x6:nanmm"}) {
    const auto board = parse_board(text);
    ASSERT_FALSE(board.ok()) << text;
    EXPECT_THAT(board.error().message(), HasSubstr("chessboard:9x6:25mm")) << text;
  }
}

TEST(Board, AChessboardsCornersAreFoundToAFractionOfAPixelFromAnySide) {
  const Board board = *parse_board("chessboard:9x6:18mm");
  for (const double angle : {0.0, 0.3, M_PI, M_PI / 2}) {
    const Rigid3 pose = turned_board(board, angle);
    const auto corners = find_board(test::rendered_board(watcher(), board, pose).view(), board);
    ASSERT_EQ(corners.size(), 54U) << angle;
    EXPECT_LT(worst_corner(corners, board, watcher(), pose), 0.35)
        << "wrong ids are tens of pixels off: " << angle;
  }
}

TEST(Board, PartOfACharucoBoardHasItsNumbers) {
  const Board board = *parse_board("charuco:9x7:22mm:16mm:5X5_100");
  Rigid3 pose = turned_board(board, 0.2);
  pose.translation.x() += 0.06;  // a good part out of the picture
  const auto corners = find_board(test::rendered_board(watcher(), board, pose).view(), board);
  ASSERT_GE(corners.size(), 8U);
  EXPECT_LT(corners.size(), static_cast<std::size_t>(board.corners()));
  EXPECT_LT(worst_corner(corners, board, watcher(), pose), 0.4);
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
}  // namespace emberlock
