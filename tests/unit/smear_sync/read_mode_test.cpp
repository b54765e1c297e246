// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/read_mode.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/clock_film.h"

namespace emberlock::smear {
namespace {

using test::ClockFilm;
using testing::HasSubstr;

const ReadDirection kDirections[] = {ReadDirection::top_first, ReadDirection::bottom_first};

ReadModeOptions options(const ClockFilm& f) {
  return {.flash_rate = Hertz(f.flash_rate), .frame_rate = Hertz(23.976), .row_time = f.timing.row_time};
}

ReadMode mode_of(const ClockFilm& f) {
  auto mode = find_read_mode(film(f), options(f));
  EXPECT_TRUE(mode.ok());
  return mode.ok() ? *mode : ReadMode{};
}

/// A strobe that carries the dots once round the register and over the lamp within the film.
ClockFilm once_round(ReadDirection direction, int shifts) {
  ClockFilm f{.flash_rate = 23.976 * 0.994, .first_flash = 0.02, .frames = 240};
  f.timing.direction = direction;
  f.timing.shifts = shifts;
  return f;
}

TEST(ReadMode, BothDirectionsAndEveryNumberOfShiftsFromADetunedStrobe) {
  for (const ReadDirection direction : kDirections) {
    for (const int shifts : {720, 740, 772}) {
      for (const double lamp : {210.0, 360.0, 505.0}) {
        for (const double detuned : {0.994, 1.0055}) {
          ClockFilm f = once_round(direction, shifts);
          f.lamp = lamp;
          f.flash_rate = 23.976 * detuned;
          const ReadMode mode = mode_of(f);
          ASSERT_TRUE(mode.direction) << mode.direction_reason;
          EXPECT_EQ(*mode.direction, direction);
          ASSERT_TRUE(mode.shifts) << mode.shifts_reason;
          EXPECT_EQ(*mode.shifts, shifts);
        }
      }
    }
  }
}

TEST(ReadMode, OneSecondOfACombTellsBoth) {
  for (const ReadDirection direction : kDirections) {
    for (const int shifts : {720, 740, 772}) {
      ClockFilm f;
      f.timing.direction = direction;
      f.timing.shifts = shifts;
      f.timing.frame_period = Seconds(1 / 23.976 * (1 + 15e-6));
      const ReadMode mode = mode_of(f);
      ASSERT_EQ(mode.direction, direction) << mode.direction_reason;
      ASSERT_TRUE(mode.shifts) << mode.shifts_reason;
      EXPECT_EQ(*mode.shifts, shifts);
      ASSERT_TRUE(mode.frame_rate_error);
      EXPECT_NEAR(mode.frame_rate_error->value(), -15, 3 * mode.frame_rate_sigma.value());
    }
  }
}

TEST(ReadMode, DotsThatAreMissedAndStrayOnesAreOutvoted) {
  ClockFilm f = once_round(ReadDirection::bottom_first, 740);
  f.miss = 0.3;
  f.false_dots = 0.2;
  f.dot_noise = 0.2;
  const ReadMode mode = mode_of(f);
  EXPECT_EQ(mode.direction, ReadDirection::bottom_first) << mode.direction_reason;
  EXPECT_EQ(mode.shifts, 740) << mode.shifts_reason;
}

// What H.264 leaves of a dot where no flash came stands for a dozen frames, all on one side of the lamp.
TEST(ReadMode, AGhostThatStandsForAWhileDoesntCarryItsSideAway) {
  for (const ReadDirection direction : kDirections) {
    std::vector<FrameReading> frames = film(once_round(direction, 740));
    int above = 0;
    int below = 0;
    Rows ghost;
    for (FrameReading& f : frames) {
      if (f.reading.state != SmearState::dot) continue;
      DotReading& dot = f.reading.dots.front();
      const int seen = dot.side == Side::above ? above++ : below++;
      if (dot.side == Side::above && seen >= 30 && seen < 44) {
        if (seen == 30) ghost = dot.y + Rows(dot.y > Rows(180) ? -130 : 130);
        dot.y = ghost;
      } else if (seen >= (dot.side == Side::above ? 30 : 60)) {
        f.reading.state = SmearState::no_dot;
        f.reading.dots.clear();
      }
    }
    ASSERT_GE(std::min(above - 44, below - 60), 0);
    const auto mode = find_read_mode(frames, options(once_round(direction, 740)));
    ASSERT_TRUE(mode.ok());
    EXPECT_EQ(mode->direction, direction) << mode->direction_reason;
  }
}

// Filmed at 23.976/s, which is taken for 24/s: dots walk 1000 ppm otherwise than they should.
TEST(ReadMode, AWalkThatNoCrystalExplainsTellsNothing) {
  for (const ReadDirection direction : kDirections) {
    for (const double detuned : {24.0, 23.95, 23.99}) {
      ClockFilm f{.flash_rate = detuned, .first_flash = 0.01, .frames = 240};
      f.timing.direction = direction;
      ReadModeOptions o = options(f);
      o.frame_rate = Hertz(24.0);
      const auto mode = find_read_mode(film(f), o);
      ASSERT_TRUE(mode.ok());
      EXPECT_FALSE(mode->direction) << detuned << " " << mode->direction_reason;
      EXPECT_FALSE(mode->direction_reason.empty());
    }
  }
}

TEST(ReadMode, AStrobeInStepTellsNothing) {
  ClockFilm f{.flash_rate = 23.976, .first_flash = 0.01, .frames = 240};
  f.timing.frame_period = Seconds(1 / 23.976 * (1 - 12e-6));
  const ReadMode mode = mode_of(f);
  EXPECT_FALSE(mode.direction);
  EXPECT_THAT(mode.direction_reason, HasSubstr("detune the strobe"));
  EXPECT_FALSE(mode.shifts);
}

TEST(ReadMode, OneSideOfTheLampLeavesTheShiftsUnknown) {
  ClockFilm f{.flash_rate = 23.976 * 0.9995, .first_flash = 0.005, .frames = 240};
  f.lamp = 300;
  const ReadMode mode = mode_of(f);
  EXPECT_EQ(mode.direction, ReadDirection::top_first) << mode.direction_reason;
  EXPECT_FALSE(mode.shifts);
  EXPECT_THAT(mode.shifts_reason, HasSubstr("one side"));
}

TEST(ReadMode, ASweepOutShowsOneSideOnly) {
  ClockFilm f = once_round(ReadDirection::bottom_first, 740);
  f.sweep_out = true;
  const ReadMode mode = mode_of(f);
  EXPECT_EQ(mode.direction, ReadDirection::bottom_first);
  EXPECT_FALSE(mode.shifts);
}

TEST(ReadMode, AWrongFlashRateIsNoWalk) {
  ClockFilm f = once_round(ReadDirection::top_first, 740);
  ReadModeOptions wrong = options(f);
  wrong.flash_rate = Hertz(23.976 * 1.013);
  const auto mode = find_read_mode(film(f), wrong);
  ASSERT_TRUE(mode.ok());
  EXPECT_FALSE(mode->direction);
  EXPECT_THAT(mode->direction_reason, HasSubstr("check both rates"));
}

TEST(ReadMode, TooFewFramesSaySo) {
  ClockFilm f = once_round(ReadDirection::top_first, 740);
  f.frames = 2;
  EXPECT_THAT(mode_of(f).direction_reason, HasSubstr("film the strobe for longer"));
  EXPECT_FALSE(find_read_mode({}, {})->direction);
}

TEST(ReadMode, RatesThatAreNone) {
  for (const double rate : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_FALSE(find_read_mode({}, {.flash_rate = Hertz(rate)}).ok());
    EXPECT_FALSE(find_read_mode({}, {.frame_rate = Hertz(rate)}).ok());
  }
}

}  // namespace
}  // namespace emberlock::smear
