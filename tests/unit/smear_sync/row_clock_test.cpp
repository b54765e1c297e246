// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/row_clock.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::smear {
namespace {

constexpr double kRowTime = 54e-6;
constexpr int kRows = 720;
constexpr int kShifts = 740;

struct Film {
  double flash_rate = 300;
  double frame_period = 1 / 23.976;
  int frames = 24;
  int direction = +1;
  double dot_noise = 0.05;  // rows
  double flash_width = 20e-6;
  double miss = 0;        // probability that a dot isn't seen
  double false_dots = 0;  // a frame, on average
  std::uint64_t seed = 1;
  bool below_only = false;
};

/// Readings of combs straight from the flashes' times: dot = lamp + whole rows shifted, wrapped at K, hidden
/// near the lamp. Written from the definition, apart from the product's own forward model.
std::vector<SmearReading> film(const Film& f) {
  std::vector<SmearReading> readings;
  RandomStream random(f.seed, 9);
  const double first = random.uniform(0, 1 / f.flash_rate);
  const double lamp = random.uniform(250, 450);
  for (int i = 1; i <= f.frames; ++i) {
    SmearReading r;
    r.state = SmearState::comb;
    r.lamp = LampReading{.x = 80, .y = Rows(f.direction > 0 ? lamp : kRows - 1 - lamp)};
    for (const int read : {i - 1, i}) {
      const double start = read * f.frame_period;
      const int last = static_cast<int>(std::floor((start + kShifts * kRowTime - first) * f.flash_rate));
      for (int j = static_cast<int>(std::ceil((start - first) * f.flash_rate)); j <= last; ++j) {
        const double tau = (first + j / f.flash_rate - start) / kRowTime;
        const double w = f.flash_width / kRowTime;
        if (tau - w / 2 < 0 || tau + w / 2 >= kShifts) continue;
        // The flash's light is spread over the one or two row periods that it touches.
        const double early = std::floor(tau - w / 2);
        const double k = early + std::clamp((tau + w / 2 - early - 1) / std::max(w, 1e-9), 0.0, 1.0);
        // Charge that wraps is seen in the next image, so image i shows what read i - 1 wrapped and what read
        // i did not.
        double row = lamp + k;
        const bool wrapped = row >= kShifts;
        if (wrapped != (read == i - 1)) continue;
        if (wrapped) row -= kShifts;
        if (row >= kRows || std::abs(row - lamp) < 15 || random.uniform() < f.miss) continue;
        if (f.below_only && row < lamp) continue;
        row += random.normal(0, f.dot_noise);
        const double shown = f.direction > 0 ? row : kRows - 1 - row;
        r.dots.push_back(
            {.x = 80, .y = Rows(shown), .side = Rows(shown) < r.lamp->y ? Side::above : Side::below});
      }
    }
    if (random.uniform() < f.false_dots) {
      const double row = random.uniform(0, kRows);
      r.dots.push_back({.x = 80, .y = Rows(row), .side = Rows(row) < r.lamp->y ? Side::above : Side::below});
    }
    std::sort(r.dots.begin(), r.dots.end(),
              [](const DotReading& a, const DotReading& b) { return a.y < b.y; });
    readings.push_back(std::move(r));
  }
  return readings;
}

double error_ns(const RowClock& clock) { return (clock.row_time.value() - kRowTime) * 1e9; }

TEST(RowClock, WithinFiveNanosecondsFromOneSecondOfVideo) {
  double squares = 0;
  int inside = 0;
  constexpr int kFilms = 25;
  for (std::uint64_t seed = 0; seed < kFilms; ++seed) {
    const double rate = RandomStream(seed, 3).uniform(299.5, 300.5);
    const Result<RowClock> clock = fit_row_clock(film({.flash_rate = rate, .seed = seed}), Hertz(rate));
    ASSERT_TRUE(clock.ok()) << clock.error().message();
    squares += error_ns(*clock) * error_ns(*clock);
    if (std::abs(error_ns(*clock)) < 5) ++inside;
  }
  std::printf("t_row from 24 frames at 300 flashes/s: RMS error %.2f ns, within 5 ns in %d of %d films\n",
              std::sqrt(squares / kFilms), inside, kFilms);
  EXPECT_LE(std::sqrt(squares / kFilms), 5);
  EXPECT_GE(inside, 0.8 * kFilms);
}

TEST(RowClock, SigmaCoversTheErrorAtAnyRate) {
  int inside = 0;
  int counted = 0;
  double squares = 0;
  for (std::uint64_t seed = 0; seed < 40; ++seed) {
    const double rate = RandomStream(seed, 3).uniform(280, 320);
    const Result<RowClock> clock = fit_row_clock(film({.flash_rate = rate, .flash_width = 0, .seed = seed}),
                                                 Hertz(rate), std::nullopt, Seconds(0));
    ASSERT_TRUE(clock.ok()) << clock.error().message();
    if (clock->near_integer_pitch) continue;
    ++counted;
    squares += error_ns(*clock) * error_ns(*clock);
    if (std::abs(error_ns(*clock)) < 3 * clock->sigma.value() * 1e9) ++inside;
  }
  std::printf("flashes of no width at 280..320/s: RMS error %.2f ns, within 3 sigma in %d of %d\n",
              std::sqrt(squares / counted), inside, counted);
  EXPECT_GT(counted, 20);
  EXPECT_GE(inside, 0.98 * counted);
}

TEST(RowClock, TheStatedSetUp) {
  for (const int direction : {+1, -1}) {
    const Result<RowClock> clock = fit_row_clock(film({.direction = direction}), Hertz(300));
    ASSERT_TRUE(clock.ok());
    EXPECT_NEAR(error_ns(*clock), 0, 5);
    EXPECT_NEAR(clock->pitch.value(), 1 / (300 * kRowTime), 0.01);
    EXPECT_EQ(clock->frames, 24);
    EXPECT_GT(clock->dots, 200);
    EXPECT_LT(clock->sigma.value() * 1e9, 20);
    EXPECT_GT(clock->sigma.value(), 0);
  }
}

TEST(RowClock, MissingDotsLeaveGapsOfSeveralPitches) {
  const Result<RowClock> clock = fit_row_clock(film({.miss = 0.4}), Hertz(300));
  ASSERT_TRUE(clock.ok());
  EXPECT_NEAR(error_ns(*clock), 0, 10);
}

TEST(RowClock, FalseDotsAreLeftOut) {
  const Result<RowClock> clock = fit_row_clock(film({.miss = 0.1, .false_dots = 0.5}), Hertz(300));
  ASSERT_TRUE(clock.ok());
  EXPECT_NEAR(error_ns(*clock), 0, 10);
}

TEST(RowClock, OneSideOfTheLampAlone) {
  const Result<RowClock> clock = fit_row_clock(film({.below_only = true}), Hertz(300), Seconds(1 / 23.976));
  ASSERT_TRUE(clock.ok());
  EXPECT_NEAR(error_ns(*clock), 0, 25);
  EXPECT_FALSE(clock->shifts_modulo_pitch);
}

TEST(RowClock, TheSpacingAcrossTheLampGivesTheShiftsModuloThePitch) {
  for (const int direction : {+1, -1}) {
    const Result<RowClock> clock =
        fit_row_clock(film({.direction = direction}), Hertz(300), Seconds(1 / 23.976));
    ASSERT_TRUE(clock.ok());
    ASSERT_TRUE(clock->shifts_modulo_pitch);
    const double p = clock->pitch.value();
    EXPECT_NEAR(wrap_symmetric(clock->shifts_modulo_pitch->value() - kShifts, p), 0, 0.5);
  }
}

TEST(RowClock, IntegerPitchIsFlagged) {
  const double rate = 1 / (62.001 * kRowTime);
  const Result<RowClock> clock =
      fit_row_clock(film({.flash_rate = rate, .frame_period = 14 / rate}), Hertz(rate));
  ASSERT_TRUE(clock.ok());
  EXPECT_TRUE(clock->near_integer_pitch);
  const Result<RowClock> other = fit_row_clock(film({}), Hertz(300));
  ASSERT_TRUE(other.ok());
  EXPECT_FALSE(other->near_integer_pitch);
}

TEST(RowClock, FramesThatAreNoCombsDoNotCount) {
  std::vector<SmearReading> frames = film({});
  for (SmearReading& r : frames) r.state = SmearState::ambiguous;
  const Result<RowClock> clock = fit_row_clock(frames, Hertz(300));
  ASSERT_FALSE(clock.ok());
  EXPECT_EQ(clock.error().kind, ErrorKind::bad_input);
  EXPECT_FALSE(clock.error().remedy.empty());
  EXPECT_FALSE(fit_row_clock({}, Hertz(300)).ok());
}

TEST(RowClock, FlashRatesThatAreNone) {
  for (const double rate : {0.0, -300.0, std::nan(""), HUGE_VAL}) {
    const Result<RowClock> clock = fit_row_clock(film({}), Hertz(rate));
    ASSERT_FALSE(clock.ok());
    EXPECT_EQ(clock.error().where, "flash_rate");
  }
}

TEST(RowClock, DotsAtRandomAreNoComb) {
  std::vector<SmearReading> frames = film({.miss = 1});
  RandomStream random(5, 5);
  for (SmearReading& r : frames) {
    for (int i = 0; i < 8; ++i) {
      const double row = random.uniform(0, kRows);
      r.dots.push_back({.x = 80, .y = Rows(row), .side = Rows(row) < r.lamp->y ? Side::above : Side::below});
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
