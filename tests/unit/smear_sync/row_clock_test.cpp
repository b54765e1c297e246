// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/row_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "base/random.h"
#include "base/square.h"
#include "tests/support/clock_film.h"

namespace emberlock::smear {
namespace {

using test::ClockFilm;
using test::readings_of;

const double kRowTime = ClockFilm{}.timing.row_time.value();

/// A film whose first flash and whose lamp lie anywhere.
ClockFilm comb_film(std::uint64_t seed = 1, double rate = 300) {
  RandomStream random(seed, 10);
  ClockFilm f{
      .flash_rate = rate, .first_flash = random.uniform(0, 1 / rate), .lamp = random.uniform(250, 450)};
  f.seed = seed;
  return f;
}

/// The clock of a film, which is told its flash rate.
RowClock clock_of(const ClockFilm& f, std::optional<Seconds> period = std::nullopt) {
  const Result<RowClock> clock =
      fit_row_clock(readings_of(f), Hertz(f.flash_rate), period, Seconds(f.flash_width));
  EXPECT_TRUE(clock.ok()) << clock.error().message();
  return clock.value();
}

double error_ns(const RowClock& clock) { return (clock.row_time.value() - kRowTime) * 1e9; }

TEST(RowClockSlow, WithinFiveNanosecondsFromOneSecondOfVideo) {
  double squares = 0;
  int inside = 0;
  constexpr int kFilms = 25;
  for (std::uint64_t seed = 0; seed < kFilms; ++seed) {
    const RowClock clock = clock_of(comb_film(seed, RandomStream(seed, 3).uniform(299.5, 300.5)));
    squares += square(error_ns(clock));
    if (std::abs(error_ns(clock)) < 5) ++inside;
  }
  std::printf("t_row from 24 frames at 300 flashes/s: RMS error %.2f ns, within 5 ns in %d of %d films\n",
              std::sqrt(squares / kFilms), inside, kFilms);
  EXPECT_LE(std::sqrt(squares / kFilms), 5);
  EXPECT_GE(inside, 0.8 * kFilms);
}

TEST(RowClockSlow, SigmaCoversTheErrorAtAnyRate) {
  int inside = 0;
  int counted = 0;
  double squares = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    ClockFilm f = comb_film(seed, RandomStream(seed, 3).uniform(280, 320));
    f.flash_width = 0;
    const RowClock clock = clock_of(f);
    if (clock.near_integer_pitch) continue;
    ++counted;
    squares += square(error_ns(clock));
    if (std::abs(error_ns(clock)) < 3 * clock.sigma.value() * 1e9) ++inside;
  }
  std::printf("flashes of no width at 280..320/s: RMS error %.2f ns, within 3 sigma in %d of %d\n",
              std::sqrt(squares / counted), inside, counted);
  EXPECT_GT(counted, 20);
  EXPECT_GE(inside, 0.98 * counted);
}

TEST(RowClock, TheStatedSetUp) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    ClockFilm f = comb_film();
    f.timing.direction = direction;
    const RowClock clock = clock_of(f);
    EXPECT_NEAR(error_ns(clock), 0, 5);
    EXPECT_NEAR(clock.pitch.value(), 1 / (300 * kRowTime), 0.01);
    EXPECT_EQ(clock.frames, 24);
    EXPECT_GT(clock.dots, 200);
    EXPECT_LT(clock.sigma.value() * 1e9, 20);
    EXPECT_GT(clock.sigma.value(), 0);
  }
}

TEST(RowClock, MissingDotsLeaveGapsOfSeveralPitches) {
  ClockFilm f = comb_film();
  f.miss = 0.4;
  EXPECT_NEAR(error_ns(clock_of(f)), 0, 10);
}

TEST(RowClock, FalseDotsAreLeftOut) {
  ClockFilm f = comb_film();
  f.miss = 0.1;
  f.false_dots = 0.5;
  EXPECT_NEAR(error_ns(clock_of(f)), 0, 10);
}

TEST(RowClock, OneSideOfTheLampIsEnough) {
  ClockFilm f = comb_film();
  f.sweep_out = true;
  const RowClock clock = clock_of(f, f.timing.frame_period);
  EXPECT_NEAR(error_ns(clock), 0, 25);
  EXPECT_FALSE(clock.shifts_modulo_pitch);
}

TEST(RowClock, TheSpacingAcrossTheLampGivesTheShiftsModuloThePitch) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    ClockFilm f = comb_film();
    f.timing.direction = direction;
    const RowClock clock = clock_of(f, f.timing.frame_period);
    ASSERT_TRUE(clock.shifts_modulo_pitch);
    const Rows off = *clock.shifts_modulo_pitch - Rows(f.timing.shifts);
    EXPECT_NEAR(wrap_symmetric(off, clock.pitch).value(), 0, 0.5);
  }
}

TEST(RowClock, IntegerPitchIsFlagged) {
  ClockFilm f = comb_film(1, 1 / (62.001 * kRowTime));
  f.timing.frame_period = Seconds(14 / f.flash_rate);
  EXPECT_TRUE(clock_of(f).near_integer_pitch);
  EXPECT_FALSE(clock_of(comb_film()).near_integer_pitch);
}

TEST(RowClock, FramesThatAreNoCombsDoNotCount) {
  std::vector<SmearReading> frames = readings_of(comb_film());
  for (SmearReading& r : frames) r.state = SmearState::ambiguous;
  const Result<RowClock> clock = fit_row_clock(frames, Hertz(300));
  ASSERT_FALSE(clock.ok());
  EXPECT_EQ(clock.error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(clock.error().remedy.empty());
  EXPECT_FALSE(fit_row_clock({}, Hertz(300)).ok());
}

TEST(RowClock, FlashRatesThatAreNone) {
  for (const double rate : {0.0, -300.0, std::nan(""), HUGE_VAL}) {
    const Result<RowClock> clock = fit_row_clock(readings_of(comb_film()), Hertz(rate));
    ASSERT_FALSE(clock.ok());
    EXPECT_EQ(clock.error().where, "flash_rate");
  }
}

TEST(RowClock, DotsAtRandomAreNoComb) {
  ClockFilm dotless = comb_film();
  dotless.miss = 1;
  std::vector<SmearReading> frames = readings_of(dotless);
  RandomStream random(5, 5);
  for (SmearReading& r : frames) {
    r.state = SmearState::comb;
    for (int i = 0; i < 8; ++i) {
      const Rows row(random.uniform(0, dotless.timing.rows));
      r.dots.push_back({.x = 80, .y = row, .side = row < r.lamp->y ? Side::above : Side::below});
    }
    std::sort(r.dots.begin(), r.dots.end(),
              [](const DotReading& a, const DotReading& b) { return a.y < b.y; });
  }
  const Result<RowClock> clock = fit_row_clock(frames, Hertz(300));
  if (clock.ok()) {
    EXPECT_GT(clock->sigma.value() * 1e9, 100) << "a pitch of chance says so by its error";
  }
}

}  // namespace
}  // namespace emberlock::smear
