// SPDX-License-Identifier: Apache-2.0
#include "apply/marker.h"

#include <algorithm>
#include <charconv>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "recon/calibrate/markers.h"

namespace emberlock::apply {
namespace {

constexpr const char* kMarkerFormats =
    "Give aruco:DICTIONARY:NUMBER:EDGE (aruco:4X4_50:0:80mm; the edge of the black border), or "
    "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY in squares (charuco:5x4:30mm:22mm:4X4_50)";

Error bad_marker(std::string_view text, std::string what) {
  return {ErrorKind::bad_input, std::move(what), "--marker " + std::string(text), kMarkerFormats};
}

/// A board's frame has its origin at its first inner corner.
Eigen::Vector3d middle_of(const recon::Board& board) {
  return board.square.value() * Eigen::Vector3d((board.columns - 1) / 2.0, -(board.rows - 1) / 2.0, 0);
}

}  // namespace

Eigen::Vector2d Marker::size() const {
  if (board) return board->square.value() * Eigen::Vector2d(board->columns + 1, board->rows + 1);
  return Eigen::Vector2d::Constant(edge.value());
}

Result<Marker> parse_marker(std::string_view text) {
  Marker marker;
  if (text.starts_with("charuco:")) {
    const Result<recon::Board> board = recon::parse_board(text);
    if (!board) return bad_marker(text, board.error().what);
    marker.board = *board;
    marker.dictionary = board->dictionary;
    return marker;
  }
  constexpr std::string_view kOne = "aruco:";
  if (!text.starts_with(kOne)) return bad_marker(text, "is neither an ArUco marker nor a ChArUco board");
  const std::string_view rest = text.substr(kOne.size());
  const std::size_t first = rest.find(':');
  const std::size_t second = first == std::string_view::npos ? first : rest.find(':', first + 1);
  if (second == std::string_view::npos || rest.find(':', second + 1) != std::string_view::npos)
    return bad_marker(text, "has too few parts, or too many");
  const std::string_view name = rest.substr(0, first);
  const auto dictionary = recon::marker_dictionary_name(name);
  if (!dictionary)
    return bad_marker(text, fmt::format("no dictionary is called \"{}\"; there are {}", name,
                                        fmt::join(recon::marker_dictionaries(), ", ")));
  marker.dictionary = *dictionary;
  const std::string_view number = rest.substr(first + 1, second - first - 1);
  const char* const end = number.data() + number.size();
  const auto read = std::from_chars(number.data(), end, marker.id);
  const int count = recon::markers_in(marker.dictionary);
  if (read.ec != std::errc() || read.ptr != end || marker.id < 0 || marker.id >= count)
    return bad_marker(text, fmt::format("\"{}\" is none of the numbers 0 to {} of {}", number, count - 1,
                                        marker.dictionary));
  const std::string_view length = rest.substr(second + 1);
  const auto edge = recon::parse_length(length);
  if (!edge) return bad_marker(text, fmt::format("\"{}\" is no length such as 80mm", length));
  marker.edge = *edge;
  return marker;
}

std::string marker_words(const Marker& marker) {
  if (marker.board) return recon::board_words(*marker.board);
  return fmt::format("aruco:{}:{}:{:g}mm", marker.dictionary, marker.id, 1e3 * marker.edge.value());
}

std::vector<MarkerPoint> find_marker(const ImageView& picture, const Marker& marker,
                                     const recon::Intrinsics& lens, const std::array<float, 256>* light) {
  std::vector<MarkerPoint> points;
  if (marker.board) {
    const Eigen::Vector3d middle = middle_of(*marker.board);
    for (const recon::BoardCorner& corner : recon::find_board(picture, *marker.board))
      points.push_back({marker.board->point(corner.id) - middle, corner.pixel});
    return points;
  }
  const double half = marker.edge.value() / 2;
  const std::array<Eigen::Vector3d, 4> corners = {
      {{-half, half, 0}, {half, half, 0}, {half, -half, 0}, {-half, -half, 0}}};
  for (const recon::MarkerInk ink : {recon::MarkerInk::dark, recon::MarkerInk::light}) {
    for (const recon::SeenMarker& seen : recon::find_markers(picture, marker.dictionary, lens, light, ink)) {
      if (seen.id != marker.id) continue;
      if (!points.empty()) return {};  // two of one number determine no pose
      for (std::size_t c = 0; c < 4; ++c) points.push_back({corners[c], seen.corners[c]});
    }
    if (!points.empty()) break;
  }
  return points;
}

bool is_mirrored(const ImageView& picture, const Marker& marker, const recon::Intrinsics& lens) {
  return !find_marker(recon::mirror_picture(picture).view(), marker, lens).empty();
}

std::string other_markers(const ImageView& picture, const recon::Intrinsics& lens) {
  std::string words;
  std::size_t most = 0;
  for (const std::string& dictionary : recon::marker_dictionaries()) {
    std::vector<int> ids;
    for (const recon::SeenMarker& seen : recon::find_markers(picture, dictionary, lens))
      ids.push_back(seen.id);
    if (ids.size() <= most) continue;
    most = ids.size();
    std::sort(ids.begin(), ids.end());
    constexpr std::size_t kNamed = 8;
    if (ids.size() > kNamed) ids.resize(kNamed);
    words = most == 1 ? fmt::format("a marker of {}, number {}", dictionary, ids.front())
                      : fmt::format("markers of {}, numbers {}{}", dictionary, fmt::join(ids, ", "),
                                    most > kNamed ? " and so on" : "");
  }
  return words;
}

}  // namespace emberlock::apply
