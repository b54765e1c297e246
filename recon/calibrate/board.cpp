// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/board.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>

#include <opencv2/aruco/charuco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "recon/calibrate/marker_dictionary.h"
#include "recon/calibrate/markers.h"

namespace emberlock::recon {
namespace {

constexpr int kFewestCorners = 6;
constexpr double kChessWindow = 0.5;  // of the smallest distance between corners, on either side
constexpr int kWidestWindow = 11;     // pixels on either side
constexpr int kMostSquares = 100;     // per side
constexpr const char* kBoardFormats =
    "Give chessboard:COLUMNSxROWS:SQUARE in inner corners (chessboard:9x6:25mm), or "
    "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY in squares (charuco:11x8:30mm:22mm:5X5_100)";

Error bad_board(std::string_view text, std::string what) {
  return {ErrorKind::bad_input, std::move(what), "--board " + std::string(text), kBoardFormats};
}

std::vector<std::string_view> split_at(std::string_view text, char separator) {
  std::vector<std::string_view> parts;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t to = std::min(text.find(separator, from), text.size());
    parts.push_back(text.substr(from, to - from));
    from = to + 1;
  }
  return parts;
}

std::optional<std::pair<int, int>> parse_counts(std::string_view text) {
  const auto parts = split_at(text, 'x');
  if (parts.size() != 2) return std::nullopt;
  std::array<int, 2> counts{};
  for (std::size_t i = 0; i < 2; ++i) {
    const char* last = parts[i].data() + parts[i].size();
    const auto [end, error] = std::from_chars(parts[i].data(), last, counts[i]);
    if (error != std::errc{} || end != last) return std::nullopt;
  }
  return std::pair(counts[0], counts[1]);
}

cv::Ptr<cv::aruco::CharucoBoard> aruco_board(const Board& board) {
  return cv::aruco::CharucoBoard::create(
      board.columns + 1, board.rows + 1, static_cast<float>(board.square.value()),
      static_cast<float>(board.marker.value()), marker_dictionary(board.dictionary));
}

/// Orders the corners by rows from the left as seen, beginning at the end whose inner square is black.
void order_corners(std::vector<cv::Point2f>& corners, const Board& board, const cv::Mat& grey) {
  const auto at = [&](int column, int row) -> cv::Point2f& {
    return corners[static_cast<std::size_t>(row) * static_cast<std::size_t>(board.columns) +
                   static_cast<std::size_t>(column)];
  };
  const cv::Point2f along = at(board.columns - 1, 0) - at(0, 0);
  const cv::Point2f down = at(0, board.rows - 1) - at(0, 0);
  if (along.x * down.y - along.y * down.x < 0) {
    for (int row = 0; row < board.rows; ++row)
      std::reverse(corners.begin() + row * board.columns, corners.begin() + (row + 1) * board.columns);
  }
  if (board.ambiguous()) return;
  double first = 0;  // brightness of the squares of the first one's colour, minus the others'
  for (int row = 0; row + 1 < board.rows; ++row) {
    for (int column = 0; column + 1 < board.columns; ++column) {
      const cv::Point2f middle =
          0.25F * (at(column, row) + at(column + 1, row) + at(column, row + 1) + at(column + 1, row + 1));
      const cv::Point p(cvRound(middle.x), cvRound(middle.y));
      if (p.x < 0 || p.y < 0 || p.x >= grey.cols || p.y >= grey.rows) continue;
      first += ((column + row) % 2 == 0 ? 1 : -1) * static_cast<double>(grey.at<std::uint8_t>(p));
    }
  }
  if (first > 0) std::reverse(corners.begin(), corners.end());
}

/// The smallest distance between neighbouring corners, pixels.
double least_step(const std::vector<cv::Point2f>& corners, const std::vector<int>& ids, const Board& board) {
  double least = INFINITY;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    for (std::size_t j = 0; j < ids.size(); ++j) {
      const bool beside = ids[j] == ids[i] + 1 && ids[j] % board.columns > 0;
      if (beside || ids[j] == ids[i] + board.columns)
        least = std::min(least, cv::norm(corners[i] - corners[j]));
    }
  }
  return least;
}

/// Moves corners to where the gradients around them meet, with subpixel accuracy, in a window that contains
/// no other edge: `share` of the smallest distance between corners, on either side.
void refine(std::vector<cv::Point2f>& corners, const std::vector<int>& ids, const Board& board,
            const cv::Mat& grey, double share) {
  if (corners.empty()) return;
  const double reach = std::min<double>(share * least_step(corners, ids, board), kWidestWindow);
  const int half = std::max(2, static_cast<int>(reach));
  cv::cornerSubPix(grey, corners, {half, half}, {-1, -1},
                   {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 50, 1e-3});
}

/// Tries the detector that tolerates glare and blur, then the other one.
std::vector<BoardCorner> find_chessboard(const cv::Mat& grey, const Board& board) {
  const cv::Size size(board.columns, board.rows);
  std::vector<cv::Point2f> corners;
  const bool found = cv::findChessboardCornersSB(grey, size, corners,
                                                 cv::CALIB_CB_NORMALIZE_IMAGE | cv::CALIB_CB_ACCURACY) ||
                     cv::findChessboardCorners(grey, size, corners,
                                               cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE |
                                                   cv::CALIB_CB_FAST_CHECK);
  if (!found || corners.size() != static_cast<std::size_t>(board.corners())) return {};
  std::vector<int> ids(corners.size());
  std::iota(ids.begin(), ids.end(), 0);
  refine(corners, ids, board, grey, kChessWindow);
  order_corners(corners, board, grey);
  std::vector<BoardCorner> result;
  for (std::size_t i = 0; i < corners.size(); ++i)
    result.push_back({ids[i], {corners[i].x + 0.5, corners[i].y + 0.5}});
  return result;
}

std::vector<BoardCorner> find_charuco(const cv::Mat& grey, const Board& board) {
  const auto aruco = aruco_board(board);
  const double margin = 0.5 * (board.square.value() / board.marker.value() - 1);
  const FoundQuads markers = find_quads(grey, aruco->dictionary, margin);
  if (markers.ids.empty()) return {};
  std::vector<cv::Point2f> corners;
  std::vector<int> ids;
  cv::aruco::interpolateCornersCharuco(markers.corners, markers.ids, grey, aruco, corners, ids);
  // OpenCV's corners are half a pixel too far to the lower right. The marker's edge limits the window.
  refine(corners, ids, board, grey, 0.5 * (1 - board.marker.value() / board.square.value()));
  std::vector<BoardCorner> result;
  for (std::size_t i = 0; i < ids.size(); ++i)
    if (ids[i] >= 0 && ids[i] < board.corners())
      result.push_back({ids[i], {corners[i].x + 0.5, corners[i].y + 0.5}});
  return result;
}

bool spans_a_plane(const std::vector<BoardCorner>& corners, const Board& board) {
  const auto differ = [&](auto part) {
    return std::any_of(corners.begin(), corners.end(),
                       [&](const BoardCorner& c) { return part(c) != part(corners.front()); });
  };
  return differ([&](const BoardCorner& c) { return c.id % board.columns; }) &&
         differ([&](const BoardCorner& c) { return c.id / board.columns; });
}

}  // namespace

std::optional<Meters> parse_length(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{}) return std::nullopt;
  const std::string_view unit(end, static_cast<std::size_t>(text.data() + text.size() - end));
  const double scale = unit == "mm" ? 1e-3 : unit == "cm" ? 1e-2 : unit == "m" ? 1 : 0;
  const double metres = value * scale;
  if (!(metres >= 1e-5 && metres <= 100)) return std::nullopt;
  return Meters(metres);
}

Result<Board> parse_board(std::string_view text) {
  const auto parts = split_at(text, ':');
  Board board;
  if (parts[0] == "charuco") {
    board.kind = BoardKind::charuco;
  } else if (parts[0] != "chessboard") {
    return bad_board(text, "is neither a chessboard nor a ChArUco board");
  }
  const bool charuco = board.kind == BoardKind::charuco;
  if (parts.size() != (charuco ? 5U : 3U)) return bad_board(text, "has too few parts, or too many");
  const auto counts = parse_counts(parts[1]);
  if (!counts) return bad_board(text, "\"" + std::string(parts[1]) + "\" is no size such as 9x6");
  board.columns = counts->first - (charuco ? 1 : 0);
  board.rows = counts->second - (charuco ? 1 : 0);
  if (std::min(board.columns, board.rows) < 2 || std::max(board.columns, board.rows) > kMostSquares)
    return bad_board(text, "needs 2 to 100 inner corners along each side");
  const auto square = parse_length(parts[2]);
  if (!square) return bad_board(text, "\"" + std::string(parts[2]) + "\" is no length such as 25mm");
  board.square = *square;
  if (!charuco) return board;
  const auto marker = parse_length(parts[3]);
  if (!marker || *marker >= board.square)
    return bad_board(text, "\"" + std::string(parts[3]) + "\" is no marker's edge below that of a square");
  board.marker = *marker;
  const auto dictionary = marker_dictionary_name(parts[4]);
  if (!dictionary) {
    std::string names;
    for (const std::string& name : marker_dictionaries()) names += (names.empty() ? "" : ", ") + name;
    return bad_board(text, "no dictionary is called \"" + std::string(parts[4]) + "\"; there are " + names);
  }
  board.dictionary = *dictionary;
  if (markers_in(board.dictionary) < (board.columns + 1) * (board.rows + 1) / 2)
    return bad_board(text, "the dictionary has fewer markers than the board");
  return board;
}

Board lamp_as_board() { return {.kind = BoardKind::lamp, .columns = 1, .rows = 1}; }

std::string noun_of(const Board& board) { return board.kind == BoardKind::lamp ? "lamp" : "board"; }

BoardSearch search_for(const Board& board) {
  BoardSearch search{board, [board](const ImageView& picture) { return find_board(picture, board); }};
  if (board.kind == BoardKind::charuco) {
    search.find_mirrored = [board](const ImageView& picture) {
      return !find_board(mirror_picture(picture).view(), board).empty();
    };
  }
  return search;
}

std::string board_words(const Board& board) {
  if (board.kind == BoardKind::lamp) return "lamp";
  const auto mm = [](Meters length) {
    std::array<char, 32> digits{};
    const auto [end, error] =
        std::to_chars(digits.data(), digits.data() + digits.size(), std::round(length.value() * 1e9) / 1e6);
    return std::string(digits.data(), end) + "mm";
  };
  if (board.kind == BoardKind::chessboard) {
    return "chessboard:" + std::to_string(board.columns) + "x" + std::to_string(board.rows) + ":" +
           mm(board.square);
  }
  return "charuco:" + std::to_string(board.columns + 1) + "x" + std::to_string(board.rows + 1) + ":" +
         mm(board.square) + ":" + mm(board.marker) + ":" + board.dictionary;
}

std::vector<BoardCorner> find_board(const ImageView& picture, const Board& board) {
  const cv::Mat grey = grey_of(picture);
  if (std::min(grey.cols, grey.rows) < 16) return {};
  const auto usable = [&](std::vector<BoardCorner> corners) {
    const bool enough = corners.size() >= std::min(static_cast<std::size_t>(kFewestCorners),
                                                   static_cast<std::size_t>(board.corners()));
    if (!enough || !spans_a_plane(corners, board)) corners.clear();
    return corners;
  };
  if (board.kind == BoardKind::chessboard) return usable(find_chessboard(grey, board));
  std::vector<BoardCorner> corners = usable(find_charuco(grey, board));
  if (!corners.empty()) return corners;
  cv::Mat negative;
  cv::bitwise_not(grey, negative);
  return usable(find_charuco(negative, board));
}

Image draw_board(const Board& board, int square) {
  const int columns = board.columns + 1;
  const int rows = board.rows + 1;
  Image image({{(columns + 2) * square, (rows + 2) * square}, PixelFormat::gray8, 8});
  cv::Mat all(image.layout().size.height, image.layout().size.width, CV_8U, image.bytes().data());
  all.setTo(255);
  cv::Mat inner = all(cv::Rect(square, square, columns * square, rows * square));
  if (board.kind == BoardKind::charuco) {
    cv::Mat drawn;
    aruco_board(board)->draw(inner.size(), drawn, 0, 1);
    drawn.copyTo(inner);
    return image;
  }
  for (int row = 0; row < rows; ++row)
    for (int column = 0; column < columns; ++column)
      if ((row + column) % 2 == 0) inner(cv::Rect(column * square, row * square, square, square)).setTo(0);
  return image;
}

}  // namespace emberlock::recon
