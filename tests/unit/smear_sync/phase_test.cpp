// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/phase.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/support/clock_film.h"
#include "tests/support/shift_register.h"

namespace emberlock::smear {
namespace {

using test::reading_of;
using test::shift_register;

constexpr Seconds kShort = microseconds(1);

TEST(Phase, DotsOnOppositeSidesAreInStepWhenTheCircleSaysSo) {
  const CcdTiming timing{.shifts = 740};
  // The same phase, lamps at different rows: the second dot has left the image at the top and came in below.
  const Seconds tau = Rows(400.5) * timing.row_time;
  const auto a = shift_register(timing, 200, tau);
  const auto b = shift_register(timing, 500, tau);
  ASSERT_TRUE(a && b);
  ASSERT_GT(*a, 200);
  ASSERT_LT(*b, 500);
  const Phase pa = phase_of(reading_of(*a, 200), timing, kShort);
  const Phase pb = phase_of(reading_of(*b, 500), timing, kShort);
  EXPECT_NEAR(phase_error(pa, pb, timing.frame_period).value(), 0, 1e-12);
}

TEST(Phase, WrapsModuloTheFramePeriodNotTheRows) {
  const CcdTiming timing;
  Phase first;
  Phase last;
  first.tau = Rows(5.5) * timing.row_time;
  last.tau = Rows(715.5) * timing.row_time;
  EXPECT_NEAR((phase_error(first, last, timing.frame_period) / timing.row_time).value(), 62.4, 0.1);
}

TEST(Phase, BlindIsNotUnusableAndNeitherIsAnError) {
  SmearReading reading;
  for (const auto state : {SmearState::no_dot, SmearState::blind}) {
    reading.state = state;
    EXPECT_EQ(phase_of(reading, {}, kShort).state, PhaseState::blind);
  }
  for (const auto state : {SmearState::comb, SmearState::steady, SmearState::saturated, SmearState::ambiguous,
                           SmearState::no_lamp, SmearState::dot}) {
    reading.state = state;
    reading.reason = "because";
    EXPECT_EQ(phase_of(reading, {}, kShort).state, PhaseState::unusable);
    EXPECT_FALSE(phase_of(reading, {}, kShort).reason.empty());
  }
}

TEST(Phase, ShortFlashesCarryNoSubRowPhaseAndLongOnesDo) {
  const auto row = microseconds_per_row(54);
  EXPECT_NEAR((row_resolution(row, Seconds(0)) / row).value(), 1 / std::sqrt(12.0), 1e-12);
  EXPECT_NEAR((row_resolution(row, microseconds(20)) / row).value(), 0.144, 0.001);
  EXPECT_EQ(row_resolution(row, microseconds(60)).value(), 0);
}

TEST(Phase, ExpectedBeatOfThePapersStrobe) {
  const PeriodOffset period_offset =
      expected_period_offset(Hertz(23.98), period(Hertz(23.976)), PartsPerMillion(1));
  EXPECT_NEAR(period_offset.rate.value(), -166.8, 0.1);
}

std::vector<PhaseSample> samples_at(std::initializer_list<double> rows, double sigma_rows = 0.3) {
  std::vector<PhaseSample> samples;
  for (const double r : rows) {
    const Seconds tau = wrap_positive(Rows(r) * microseconds_per_row(54), Seconds(1 / 23.976));
    samples.push_back({TimePoint{static_cast<std::int64_t>(samples.size()) * 41'708'375},
                       {PhaseState::known, tau, Rows(sigma_rows) * microseconds_per_row(54), {}}});
  }
  return samples;
}

double rows_of(const Phase& phase) { return (phase.tau / microseconds_per_row(54)).value(); }

TEST(Combine, JitterAtTheWrapAveragesAcrossIt) {
  const Phase phase = combine(samples_at({-0.4, 0.3, -0.2, 0.5, 0.3}), {}, {});
  ASSERT_EQ(phase.state, PhaseState::known);
  EXPECT_NEAR(wrap_symmetric(rows_of(phase), 772.39), 0.1, 0.01);
}

// A strobe that jitters by three rows about the instant at which charge begins to move: dots stand just above
// the lamp, wrapped, and just below it.
TEST(Combine, AStrobeThatJittersAtTheWrapIsReadFromItsFilm) {
  for (const auto direction : {ReadDirection::top_first, ReadDirection::bottom_first}) {
    test::ClockFilm f{.flash_rate = 23.976, .first_flash = 0, .frames = 96, .jitter = 160e-6, .hidden = 0};
    f.timing = {.rows = 720, .shifts = 772, .direction = direction};
    std::vector<PhaseSample> samples;
    int wrapped = 0;
    for (const FrameReading& frame : film(f)) {
      const TimePoint at = TimePoint{} + f.timing.frame_period * static_cast<double>(frame.frame);
      samples.push_back({at, phase_of(frame.reading, f.timing, Seconds(f.flash_width))});
      const Phase& phase = samples.back().phase;
      // What the jitter does to one frame, beside its own error.
      if (phase.state == PhaseState::known) samples.back().phase.sigma = Seconds(160e-6);
      wrapped += phase.state == PhaseState::known && phase.tau > f.timing.frame_period / 2 ? 1 : 0;
    }
    EXPECT_GT(wrapped, 20);
    EXPECT_LT(wrapped, 76);
    const Phase phase = combine(samples, TimePoint{}, {.period = f.timing.frame_period});
    ASSERT_EQ(phase.state, PhaseState::known) << phase.reason;
    EXPECT_LT(abs(wrap_symmetric(phase.tau, f.timing.frame_period)), 4 * phase.sigma);
    EXPECT_LT(phase.sigma, microseconds(25));
  }
}

TEST(Combine, DropsTheFrameThatShowsAnotherDot) {
  const Phase phase = combine(samples_at({100, 100.2, 341, 99.8, 100}), {}, {});
  ASSERT_EQ(phase.state, PhaseState::known);
  EXPECT_NEAR(rows_of(phase), 100, 0.01);
}

TEST(Combine, AbstainsWhenFramesDisagree) {
  const Phase phase = combine(samples_at({100, 341}), {}, {});
  EXPECT_EQ(phase.state, PhaseState::unusable);
  EXPECT_FALSE(phase.reason.empty());
}

TEST(Combine, AFalseDotAmongBlindFramesStaysBlind) {
  auto samples = samples_at({100, 0, 0, 0});
  for (std::size_t i = 1; i < 4; ++i) samples[i].phase = {PhaseState::blind, {}, {}, "no dot"};
  const Phase phase = combine(samples, {}, {});
  EXPECT_EQ(phase.state, PhaseState::blind);
  EXPECT_EQ(phase.reason, "no dot");
}

TEST(Combine, NoFramesAreUnusable) { EXPECT_EQ(combine({}, {}, {}).state, PhaseState::unusable); }

TEST(Combine, MoreFramesOfOneRowDoNotBeatTheRowsOwnError) {
  CircleOptions options;
  options.resolution = row_resolution(microseconds_per_row(54), microseconds(20));
  const std::vector<PhaseSample> samples(1000, samples_at({100}).front());
  EXPECT_GE(combine(samples, {}, options).sigma, options.resolution);
}

// Cameras read one after the other, one second apart, while the strobe is off by 167 ppm: 3.1 rows a second.
TEST(Refer, CamerasReadOneAfterTheOtherUnderABeat) {
  const Seconds T(1 / 23.976);
  const SecondsPerRow row = microseconds_per_row(54);
  const double beat = -167e-6;
  std::vector<std::vector<PhaseSample>> rig(11);
  for (std::size_t camera = 0; camera < rig.size(); ++camera) {
    for (int frame = 0; frame < 8; ++frame) {
      const double t = static_cast<double>(camera) + frame * T.value();
      const double noise = 0.3 * random_normal(5, camera, static_cast<std::uint64_t>(frame));
      const Seconds tau = wrap_positive(Rows(700 + noise) * row + Seconds(beat * t), T);  // all in step
      rig[camera].push_back({TimePoint{} + Seconds(t), {PhaseState::known, tau, Rows(0.3) * row, {}}});
    }
  }
  CircleOptions options{.period = T, .period_offset = {PartsPerMillion(-160), PartsPerMillion(20)}};
  const CommonPhases common = refer(rig, options);
  EXPECT_NEAR(common.period_offset.rate.value(), -167, 3 * common.period_offset.sigma.value());
  EXPECT_LT(common.period_offset.sigma, PartsPerMillion(20));
  for (const Phase& phase : common.phases) {
    EXPECT_NEAR((phase_error(phase, common.phases.front(), T) / row).value(), 0, 3.0);
  }
  // Left alone, the beat would pull the first and the last apart by 30 rows.
  options.period_offset = {};
  const CommonPhases pulled = refer(rig, options);
  EXPECT_GT(std::abs((phase_error(pulled.phases.back(), pulled.phases.front(), T) / row).value()), 25);
}

TEST(Refer, WithoutAnyDotKeepsTheBeatThatWasPromised) {
  std::vector<std::vector<PhaseSample>> rig(2);
  rig[0].push_back({TimePoint{5}, {PhaseState::blind, {}, {}, "no dot"}});
  const CommonPhases common = refer(rig, {.period_offset = {PartsPerMillion(7), PartsPerMillion(3)}});
  EXPECT_NEAR(common.period_offset.rate.value(), 7, 1e-12);
  EXPECT_EQ(common.phases[0].state, PhaseState::blind);
  EXPECT_EQ(common.phases[1].state, PhaseState::unusable);
}

}  // namespace
}  // namespace emberlock::smear
