// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/ccd_model.h"

#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include <gtest/gtest.h>

namespace emberlock::smear {
namespace {

// Row times that binary floating point holds exactly, so that borders between row periods are exact too.
CcdTiming timing(ReadDirection direction, int shifts = 100) {
  return {.rows = 100,
          .shifts = shifts,
          .frame_period = Seconds(130.0 / 1024),
          .row_time = SecondsPerRow(1.0 / 1024),
          .direction = direction};
}
Flash at_row_time(double k, double width = 0.25) { return {Seconds(k / 1024), Seconds(width / 1024)}; }

/// A flash of a quarter row time, centred `at` row times after the read phase began, over a lamp in row 30.
struct ShortFlash {
  const char* name;
  ReadDirection direction;
  int shifts;
  double at;
  std::optional<std::pair<int, int>> seen;  ///< image and row
  SweepOut sweep_out = SweepOut::none;
  double width = 0.25;
};

class ShortFlashes : public testing::TestWithParam<ShortFlash> {};

TEST_P(ShortFlashes, ShowInOneRowOrNone) {
  const ShortFlash& f = GetParam();
  const auto deposits =
      smear_deposits(timing(f.direction, f.shifts), 30, at_row_time(f.at, f.width), f.sweep_out);
  ASSERT_EQ(deposits.size(), f.seen ? 1U : 0U);
  if (!f.seen) return;
  EXPECT_EQ(std::pair(deposits[0].image, deposits[0].row), *f.seen);
  EXPECT_DOUBLE_EQ(deposits[0].fraction, 1);
}

constexpr auto kTopFirst = ReadDirection::top_first;
constexpr auto kSwept = SweepOut::before_transfer;
using At = std::pair<int, int>;
INSTANTIATE_TEST_SUITE_P(
    CcdModel, ShortFlashes,
    testing::Values(
        ShortFlash{"TopFirstMovesTheDotDownInTheSameImage", kTopFirst, 100, 20.5, At{0, 50}},
        ShortFlash{"BottomFirstMovesTheDotUpInTheSameImage", ReadDirection::bottom_first, 100, 20.5,
                   At{0, 10}},
        ShortFlash{"AWrappedDotIsSeenInTheNextImageAboveTheLamp", kTopFirst, 100, 80.5, At{1, 10}},
        ShortFlash{"AWrappedDotIsSeenInTheNextImageBelowTheLamp", ReadDirection::bottom_first, 100, 80.5,
                   At{1, 50}},
        ShortFlash{"TheLastRowShowsBeforeTheDummyLines", kTopFirst, 120, 69.5, At{0, 99}},
        ShortFlash{"TheFirstDummyLineHidesTheDot", kTopFirst, 120, 70.5, {}},
        ShortFlash{"TheLastDummyLineHidesTheDot", kTopFirst, 120, 89.5, {}},
        ShortFlash{"DummyLinesDelayTheWrap", kTopFirst, 120, 90.5, At{1, 0}},
        ShortFlash{"DuringTheRestTheChargeStaysOnTheLampOfTheNextImage", kTopFirst, 100, 115, At{1, 30}},
        ShortFlash{"BeforeTheReadPhaseTheFlashBelongsToTheRestOfTheFrameBefore", kTopFirst, 100, -1.5,
                   At{0, 30}},
        ShortFlash{"SweepOutTakesTheWrappedDot", kTopFirst, 100, 80.5, {}, kSwept},
        ShortFlash{"SweepOutTakesTheRest", kTopFirst, 100, 115, {}, kSwept},
        ShortFlash{"SweepOutLeavesTheSideReadAfterTheLamp", kTopFirst, 100, 20.5, At{0, 50}, kSwept},
        ShortFlash{"AFlashExactlyAtARowBorderCountsForTheRowThatBegins", kTopFirst, 100, 21, At{0, 51},
                   SweepOut::none, 0}),
    [](const auto& test) { return test.param.name; });

TEST(CcdModel, AFlashAcrossTwoRowPeriodsSplitsByTime) {
  const auto deposits = smear_deposits(timing(ReadDirection::top_first), 30, at_row_time(21.1, 0.4));
  ASSERT_EQ(deposits.size(), 2U);
  EXPECT_EQ(deposits[0].row, 50);
  EXPECT_EQ(deposits[1].row, 51);
  EXPECT_NEAR(deposits[0].fraction, 0.25, 1e-12);
  EXPECT_NEAR(deposits[1].fraction, 0.75, 1e-12);
}

TEST(CcdModel, ConstantLightGivesEveryRowOneRowTime) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    const CcdTiming t = timing(direction, 120);
    // Lit from the read phase of frame -1 on: image 0 then has its wrapped half too.
    std::vector<double> column(100);
    for (const SmearDeposit& d : smear_deposits(t, 30, {Seconds(0), t.frame_period * 2})) {
      if (d.image == 0) column[d.row] += d.fraction;
    }
    for (int y = 0; y < 100; ++y) {
      const double row_times =
          y == 30 ? 1 + (130 - 120) : 1;  // the lamp's own row also rests under the light
      EXPECT_NEAR(column[y] * 260, row_times, 1e-9) << "row " << y;
    }
  }
}

TEST(CcdModel, EqualDistancesOnOppositeSidesAreDifferentPhases) {
  const CcdTiming t = timing(ReadDirection::top_first);
  EXPECT_EQ(shifts_between(t, Rows(40), Rows(50)), Rows(10));
  EXPECT_EQ(shifts_between(t, Rows(40), Rows(30)), Rows(90));
}

TEST(CcdModel, CentreOfADotAtTheImageEdgeIsWithinHalfARow) {
  const CcdTiming t = timing(ReadDirection::top_first);
  const auto last = smear_centre(t, Rows(30.4), {.frame = 0, .shifts = 69, .fraction = 1});
  ASSERT_TRUE(last);
  EXPECT_EQ(last->image, 0);
  EXPECT_NEAR(last->row.value(), 99.4, 1e-12);
  const auto wrapped = smear_centre(t, Rows(30.6), {.frame = 0, .shifts = 69, .fraction = 1});
  ASSERT_TRUE(wrapped);
  EXPECT_EQ(wrapped->image, 1);
  EXPECT_NEAR(wrapped->row.value(), -0.4, 1e-12);
}

TEST(CcdModel, ImpossibleTimingsAreRefusedWithTheField) {
  CcdTiming t;
  EXPECT_TRUE(check(t).ok());
  t.shifts = 719;
  EXPECT_NE(check(t).error().what.find("shifts"), std::string::npos);
  t.shifts = 773;  // T / t_row is 772.4
  EXPECT_NE(check(t).error().remedy.find("772"), std::string::npos);
  t = {};
  t.row_time = SecondsPerRow(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(check(t).error().kind, ErrorKind::bad_input);
  t = {};
  t.rows = 0;
  EXPECT_FALSE(check(t).ok());
}

}  // namespace
}  // namespace emberlock::smear
