// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <memory>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "apply/marker.h"
#include "base/file.h"
#include "cli/commands.h"
#include "recon/calibrate/markers.h"

namespace emberlock::cli {
namespace {

struct Print {
  Image picture;     ///< gray8, with its white margin
  double pixel = 0;  ///< millimetres
};

Print print_of(const apply::Marker& marker) {
  if (marker.board) {
    constexpr int kSquare = 120;
    return {recon::draw_board(*marker.board, kSquare), 1e3 * marker.board->square.value() / kSquare};
  }
  Image picture = recon::draw_marker(marker.dictionary, marker.id, 1);
  const int cells = picture.layout().size.width - 2;
  return {std::move(picture), 1e3 * marker.edge.value() / cells};
}

/// The black of some equal rows, as rectangles in pixels.
void add_rows(std::string& svg, const ImageView& picture, int from, int to) {
  const auto* row = picture.row_as<std::uint8_t>(from);
  for (int x = 0; x < picture.width();) {
    const int begin = x;
    while (x < picture.width() && row[x] < 128) ++x;
    if (x > begin)
      fmt::format_to(std::back_inserter(svg), "<path d=\"M{} {}H{}V{}H{}z\"/>\n", begin, from, x, to, begin);
    else
      ++x;
  }
}

/// SVG 1.1 whose millimetres are those of the paper.
std::string svg_of(const Print& print) {
  const ImageView picture = print.picture.view();
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.3f}mm\" height=\"{1:.3f}mm\" viewBox=\"0 0 {2} "
      "{3}\" "
      "shape-rendering=\"crispEdges\">\n<rect width=\"{2}\" height=\"{3}\" fill=\"#fff\"/>\n",
      picture.width() * print.pixel, picture.height() * print.pixel, picture.width(), picture.height());
  const auto equal = [&](int a, int b) {
    return std::equal(picture.row(a), picture.row(a) + picture.layout.row_bytes(), picture.row(b));
  };
  for (int y = 0; y < picture.height();) {
    const int from = y;
    while (y < picture.height() && equal(from, y)) ++y;
    add_rows(svg, picture, from, y);
  }
  return svg + "</svg>\n";
}

Status print_marker(const std::string& words, const std::string& out) {
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::Marker marker, apply::parse_marker(words));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(out, svg_of(print_of(marker))));
  const Eigen::Vector2d size = 1e3 * marker.size();
  std::printf("%s: print it at 100 %%; its black is %g x %g mm\n", out.c_str(), size.x(), size.y());
  return {};
}

}  // namespace

void add_marker(const Verb& app) {
  struct Arguments {
    std::string marker, out;
  };
  auto arguments = std::make_shared<Arguments>();
  const Verb verb = app.add_verb("marker", "Draws a marker or a board for printing, in its size");
  verb.add_option("MARKER", arguments->marker, "As `emberlock ar --marker`: aruco:4X4_50:0:80mm").require();
  verb.add_option("--out", arguments->out, "An SVG file; one that is there is replaced").require();
  verb.set_action([arguments] { or_fail(print_marker(arguments->marker, arguments->out)); });
}

}  // namespace emberlock::cli
