// SPDX-License-Identifier: Apache-2.0
#include "report/smear_strip.h"

#include <gmock/gmock.h>

namespace emberlock::report {
namespace {

smear::CcdTiming timing(smear::ReadDirection direction) {
  return {.rows = 720, .shifts = 740, .row_time = microseconds_per_row(50), .direction = direction};
}
/// The phase whose dot lies k rows from the lamp.
Seconds tau(double k) { return Rows(k + 0.5) * microseconds_per_row(50); }

void expect_span(const RowSpan& span, double from, double to) {
  EXPECT_NEAR(span.from.value(), from, 1e-9);
  EXPECT_NEAR(span.to.value(), to, 1e-9);
}

TEST(ToleranceBand, LiesBelowTheLampWhenTheTopRowIsReadFirst) {
  const auto spans = tolerance_band(timing(smear::ReadDirection::top_first), Rows(300), tau(200), Rows(50));
  ASSERT_EQ(spans.size(), 1U);
  expect_span(spans[0], 450, 550);
}

TEST(ToleranceBand, LiesAboveTheLampWhenTheBottomRowIsReadFirst) {
  const auto spans =
      tolerance_band(timing(smear::ReadDirection::bottom_first), Rows(300), tau(200), Rows(50));
  ASSERT_EQ(spans.size(), 1U);
  expect_span(spans[0], 50, 150);
}

TEST(ToleranceBand, GoesAroundTheEdgeModuloK) {
  // k = 400..500 from row 300: rows 700..719, dummy lines 720..739, then rows 0..60.
  const auto spans = tolerance_band(timing(smear::ReadDirection::top_first), Rows(300), tau(450), Rows(50));
  ASSERT_EQ(spans.size(), 2U);
  expect_span(spans[0], 700, 719);
  expect_span(spans[1], 0, 60);
}

TEST(ToleranceBand, IsNotDrawnInTheRest) {
  const auto spans = tolerance_band(timing(smear::ReadDirection::top_first), Rows(300), tau(760), Rows(10));
  EXPECT_TRUE(spans.empty());
}

TEST(SmearStrip, FrameWithoutALampIsStillShown) {
  const Image frame({{20, 10}, PixelFormat::gray8, 8});
  EXPECT_THAT(smear_strip_svg(frame.view(), {}, {}), testing::HasSubstr("</svg>"));
}

}  // namespace
}  // namespace emberlock::report
