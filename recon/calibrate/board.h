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
  chessboard,  ///< must be visible completely
  charuco,     ///< markers number its corners, so a part of it is enough
  lamp,  ///< not a board but a small lamp, treated as a single corner: it has a position and no orientation
};

/// A flat board of squares. Its frame, for a viewer in front of it: x along a row, y up, z out of the board,
/// in metres, with the origin at its first corner. Corners are the inner ones, counted row by row from the
/// first.
struct Board {
  BoardKind kind = BoardKind::chessboard;
  int columns = 9;  ///< number of inner corners
  int rows = 6;     ///< number of inner corners
  Meters square{0.025};
  Meters marker{0};             ///< edge length of a ChArUco board's markers
  std::string dictionary = {};  ///< of the markers, by OpenCV's names: "4X4_50", "5X5_100", ...

  [[nodiscard]] int corners() const { return columns * rows; }
  [[nodiscard]] Eigen::Vector3d point(int corner) const {
    const int row = corner / columns;
    return {square.value() * (corner % columns), -square.value() * row, 0};
  }
  /// Whether it looks the same upside down. Then cameras on different sides may assign its corners in
  /// opposite order. A chessboard does if its numbers of corners are both even or both odd.
  [[nodiscard]] bool ambiguous() const { return kind == BoardKind::chessboard && (columns - rows) % 2 == 0; }
};

/// "chessboard:9x6:25mm": 9 x 6 INNER CORNERS (as in cv::findChessboardCorners), squares of 25 mm.
/// "charuco:11x8:30mm:22mm:5X5_100": 11 x 8 SQUARES (as in cv::aruco::CharucoBoard), squares, markers,
/// dictionary. Lengths in mm, cm or m. The error's remedy is the format.
Result<Board> parse_board(std::string_view text);
/// "25mm", "2.5cm" or "0.025m": 1e-5 to 100 m; nothing for any other text.
std::optional<Meters> parse_length(std::string_view text);
/// The text that parse_board() reads; "lamp" for a lamp.
std::string board_words(const Board& board);
/// "board" or "lamp".
std::string noun_of(const Board& board);
/// A lamp, as a board with one corner.
Board lamp_as_board();

/// A corner of the board in a picture.
struct BoardCorner {
  int id = 0;             ///< index of the corner, from 0
  Eigen::Vector2d pixel;  ///< recon's convention: pixel centres at +0.5
};

/// Finds the corners of a board (not of a lamp, for which smear_sync has a detector) in a picture of any
/// format, with subpixel accuracy. A ChArUco board may be printed white on black. Empty if it isn't visible,
/// or too little of it (fewer than 6 corners, or all on one line). If a chessboard isn't ambiguous(), its
/// corners are numbered the same from every side: the first is the one whose inner square is black.
std::vector<BoardCorner> find_board(const ImageView& picture, const Board& board);

/// The board to search for, and the method.
struct BoardSearch {
  Board board;
  std::function<std::vector<BoardCorner>(const ImageView& picture)> find;  ///< called by several threads
  /// Whether a picture shows the board as a mirror image. Empty if a mirrored board is one too.
  std::function<bool(const ImageView& picture)> find_mirrored = {};
};
/// A search with find_board().
BoardSearch search_for(const Board& board);

/// Draws the board for printing or rendering, `square` pixels per square, with a white margin of one square.
/// Corner (column, row) is at ((column + 2) * square, (row + 2) * square) from the picture's corner.
Image draw_board(const Board& board, int square);

}  // namespace emberlock::recon
