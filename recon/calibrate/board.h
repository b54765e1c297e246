// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"

namespace emberlock::recon {

enum class BoardKind : std::uint8_t {
  chessboard,  ///< seen whole or not at all
  charuco,     ///< markers number its corners: any part of it will do
  lamp,        ///< no board but a small lamp, taken for one corner: it has a place and no pose
};

/// A flat board of squares. Its own frame, as whoever looks at it sees it: x along a row, y up, z out of the
/// board, metres, 0 at its first corner. Corners are the inner ones, counted row by row from the first.
struct Board {
  BoardKind kind = BoardKind::chessboard;
  int columns = 9;  ///< of inner corners
  int rows = 6;     ///< of inner corners
  Meters square{0.025};
  Meters marker{0};             ///< edge of a ChArUco board's markers
  std::string dictionary = {};  ///< of these, as OpenCV names it: "4X4_50", "5X5_100", ...

  [[nodiscard]] int corners() const { return columns * rows; }
  [[nodiscard]] Eigen::Vector3d point(int corner) const {
    const int row = corner / columns;
    return {square.value() * (corner % columns), -square.value() * row, 0};
  }
  /// Whether it looks the same upside down: then cameras on different sides may take its corners for each
  /// other's opposites. A chessboard does, if both of its numbers of corners are even or both odd.
  [[nodiscard]] bool ambiguous() const { return kind == BoardKind::chessboard && (columns - rows) % 2 == 0; }
};

/// "chessboard:9x6:25mm": 9 x 6 INNER CORNERS (as cv::findChessboardCorners counts), squares of 25 mm.
/// "charuco:11x8:30mm:22mm:5X5_100": 11 x 8 SQUARES (as cv::aruco::CharucoBoard counts), squares, markers,
/// dictionary. Lengths in mm, cm or m. Error with the format as remedy.
Result<Board> parse_board(std::string_view text);
/// What parse_board() reads; "lamp" of a lamp.
std::string board_words(const Board& board);
/// "board" or "lamp".
std::string noun_of(const Board& board);
/// A lamp as the board of one corner.
Board lamp_as_board();

/// A corner of the board as a picture shows it.
struct BoardCorner {
  int id = 0;             ///< of the board's, from 0
  Eigen::Vector2d pixel;  ///< recon's convention: pixel centres at +0.5
};

/// The corners of a board (no lamp: smear_sync detects those) in a picture of any format, to a fraction of a
/// pixel; none where it isn't seen, or too little of it (fewer than 6 corners, or all on one line). A
/// chessboard that isn't ambiguous() gets the same corners from any side: its first is the one whose square
/// inside the corners is black.
std::vector<BoardCorner> find_board(const ImageView& picture, const Board& board);

/// What is looked for in pictures, and how.
struct BoardSearch {
  Board board;
  std::function<std::vector<BoardCorner>(const ImageView& picture)> find;  ///< called by several threads
};
/// By find_board().
BoardSearch search_for(const Board& board);

/// The board as a picture to print or to render, `square` pixels a square, a white margin of one square
/// around. A corner (column, row) lies at ((column + 2) * square, (row + 2) * square) from the picture's
/// corner.
Image draw_board(const Board& board, int square);

}  // namespace emberlock::recon
