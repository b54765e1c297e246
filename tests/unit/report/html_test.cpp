// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <cmath>

#include <gmock/gmock.h>

namespace emberlock::report {
namespace {
using testing::HasSubstr;
using testing::Not;

TEST(Html, TextCannotBecomeMarkup) {
  const std::string page = HtmlPage("<script>").paragraph("a < b & \"c\"").str();
  EXPECT_THAT(page, Not(HasSubstr("<script>")));
  EXPECT_THAT(page, HasSubstr("a &lt; b &amp; &quot;c&quot;"));
}

TEST(Html, PageStandsAlone) {
  Image image({{2, 2}, PixelFormat::rgb8, 8});
  const std::string page =
      HtmlPage("report").gallery({{"<img src=\"" + png_data_uri(image) + "\">", "black"}}).str();
  EXPECT_THAT(page, HasSubstr("data:image/png;base64,iVBORw0KGgo"));  // the PNG signature in base64
  EXPECT_THAT(page, Not(HasSubstr("http")));
}

TEST(Plot, NothingToShowIsStillAPlot) {
  EXPECT_THAT(svg_plot({}, {.title = "empty"}), HasSubstr("</svg>"));
  EXPECT_THAT(svg_plot({{"flat", {1, 1}, {2, 2}}}, {}), Not(HasSubstr("nan")));
}

TEST(Plot, GapsAndZeroesOnALogarithmicAxisDoNotReachTheSvg) {
  const std::string svg = svg_plot({{"error", {0, 1, 10}, {NAN, 5, 0.5}}},
                                   {.x_axis = Axis::logarithmic, .y_axis = Axis::logarithmic});
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(svg, Not(HasSubstr("inf")));
}

}  // namespace
}  // namespace emberlock::report
