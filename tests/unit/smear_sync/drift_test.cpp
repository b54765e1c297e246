// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/drift.h"

#include <cmath>

#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock::smear {
namespace {

const Seconds kDriftPeriod(1 / 23.976);
const SecondsPerRow kDriftRow = microseconds_per_row(54);

struct Walk {
  double tau0 = 0.02;
  double ppm = 3;
  double seconds = 60;
  int frames = 200;
  double noise_rows = 0.3;
  std::uint64_t seed = 1;
};

std::vector<PhaseSample> samples_of(const Walk& walk) {
  std::vector<PhaseSample> samples;
  for (int i = 0; i < walk.frames; ++i) {
    const double t = walk.seconds * i / (walk.frames - 1);
    const double noise = walk.noise_rows * random_normal(walk.seed, 3, static_cast<std::uint64_t>(i));
    const Seconds tau =
        wrap_positive(Seconds(walk.tau0 + walk.ppm * 1e-6 * t) + Rows(noise) * kDriftRow, kDriftPeriod);
    samples.push_back({TimePoint{1'000'000'000} + Seconds(t),
                       {PhaseState::known, tau, Rows(std::max(walk.noise_rows, 0.01)) * kDriftRow, {}}});
  }
  return samples;
}

DriftOptions options() { return {.period = kDriftPeriod}; }

TEST(Drift, FindsTheRateWithinItsStandardError) {
  int outside = 0;
  for (std::uint64_t seed = 0; seed < 200; ++seed) {
    const auto drift = fit_drift(samples_of({.ppm = -17.3, .seed = seed}), options());
    ASSERT_TRUE(drift.ok());
    if (std::abs(drift->rate.value() + 17.3) > 2 * drift->rate_sigma.value()) ++outside;
  }
  // 4.6 % of normal errors lie beyond two standard errors, and Huber's weights cost a little.
  EXPECT_LT(outside, 25);
  EXPECT_GT(outside, 0);
}

TEST(Drift, CrossesTheWrapManyTimes) {
  const auto drift =
      fit_drift(samples_of({.tau0 = 0.0416, .ppm = 410, .seconds = 600, .frames = 400}), options());
  ASSERT_TRUE(drift.ok());
  EXPECT_NEAR(drift->rate.value(), 410, 4 * drift->rate_sigma.value());
  EXPECT_LT(drift->rate_sigma, PartsPerMillion(0.05));
}

TEST(Drift, OneFrameInFiveIsWildAndBlindFramesArePassedOver) {
  auto samples = samples_of({.ppm = 5});
  for (std::size_t i = 0; i < samples.size(); i += 5)
    samples[i].phase.tau = Seconds(random_uniform(9, 0, i) * 0.0417);
  for (std::size_t i = 2; i < samples.size(); i += 9)
    samples[i].phase = {PhaseState::blind, {}, {}, "no dot"};
  const auto drift = fit_drift(samples, options());
  ASSERT_TRUE(drift.ok());
  EXPECT_NEAR(drift->rate.value(), 5, 0.2);
}

/// Dots on whole rows of `row`, the lamp's row `lamp_off` rows wrong.
std::vector<PhaseSample> on_stairs(SecondsPerRow row, double lamp_off) {
  auto samples = samples_of({.tau0 = 0.03, .ppm = 410, .seconds = 60, .frames = 400, .noise_rows = 0});
  for (std::size_t i = 0; i < samples.size(); ++i) {
    PhaseSample& s = samples[i];
    const double x = (s.phase.tau / kDriftRow).value();
    const Rows k(std::floor(x) + lamp_off + random_normal(5, 4, i) * 0.02);
    s.shifted = ShiftedRows{k, Rows(0.02)};
    s.phase.tau = (k + Rows(0.5)) * row;
    s.phase.sigma = Rows(0.29) * row;
  }
  return samples;
}

TEST(Drift, ALampNearHalfARowOffMayBeAWholeRowOffAndSaysSo) {
  DriftOptions with = options();
  with.row_time = kDriftRow;
  with.flash_width = microseconds(1);
  with.lamp_sigma = Rows(0.3);
  const auto rows_of_sigma = [&](double lamp_off) {
    return (fit_drift(on_stairs(kDriftRow, lamp_off), with)->tau_sigma / kDriftRow).value();
  };
  EXPECT_LT(rows_of_sigma(0.05), 0.02);
  EXPECT_NEAR(rows_of_sigma(0.5), std::sqrt(0.5), 0.1);
  EXPECT_GT(rows_of_sigma(0.3), 0.1);
  EXPECT_NEAR(rows_of_sigma(0.3), rows_of_sigma(-0.3), 0.02);
}

TEST(Drift, ARowTimeThatIsOffMovesTheLineAsStated) {
  const SecondsPerRow longer = kDriftRow * (1 + 2e-4);
  DriftOptions with = options();
  with.flash_width = microseconds(1);
  with.row_time = kDriftRow;
  with.row_time_sigma = longer - kDriftRow;
  const auto drift = fit_drift(on_stairs(kDriftRow, 0), with);
  with.row_time = longer;
  const auto moved = fit_drift(on_stairs(longer, 0), with);
  ASSERT_TRUE(drift.ok() && moved.ok());
  const Seconds by = drift->tau_by_row_time;
  const Seconds middle =
      wrap_symmetric(phase_at(*moved, drift->at, kDriftPeriod).tau - drift->tau, kDriftPeriod);
  EXPECT_GT(by, microseconds(1));
  EXPECT_NEAR(in_microseconds(middle), in_microseconds(by), 0.3);
  EXPECT_NEAR((moved->rate - drift->rate).value(), drift->rate_by_row_time.value(), 0.05);
  EXPECT_GT(std::abs(drift->rate_by_row_time.value()), 0.05);
  EXPECT_GE(drift->tau_sigma, by);
}

// Charge moves in whole rows: a slow drift shows no step for a long time. The error must say so.
TEST(DriftSlow, StaircaseOfASlowDrift) {
  int outside = 0;
  for (int i = 0; i < 50; ++i) {
    auto samples = samples_of({.tau0 = 0.01 + 2e-6 * i, .ppm = 2, .seconds = 10, .noise_rows = 0});
    for (PhaseSample& s : samples) {
      const Rows k(std::floor((s.phase.tau / kDriftRow).value()));
      s.phase.tau = (k + Rows(0.5)) * kDriftRow;
      s.phase.sigma = Rows(0.29) * kDriftRow;
      s.shifted = ShiftedRows{k, Rows(0.05)};
    }
    auto with = options();
    with.row_time = kDriftRow;
    with.flash_width = Seconds(0);
    const auto drift = fit_drift(samples, with);
    ASSERT_TRUE(drift.ok());
    EXPECT_GT(drift->rate_sigma, PartsPerMillion(1));
    if (std::abs(drift->rate.value() - 2) > 2 * drift->rate_sigma.value()) ++outside;
  }
  EXPECT_LE(outside, 8);  // the rate is one and the same in all films: no draw of what was possible
}

TEST(Drift, ThermalDriftIsFollowedByItsMeanRateWithAWiderError) {
  auto samples = samples_of({.ppm = 0, .seconds = 600});
  for (PhaseSample& s : samples) {
    const double t = (s.at - samples.front().at).value();
    s.phase.tau = wrap_positive(s.phase.tau + Seconds(1e-8 * t * t), kDriftPeriod);  // 0 to 12 ppm
  }
  const auto curved = fit_drift(samples, options());
  const auto straight = fit_drift(samples_of({.ppm = 6, .seconds = 600}), options());
  ASSERT_TRUE(curved.ok() && straight.ok());
  EXPECT_NEAR(curved->rate.value(), 6, 0.5);
  EXPECT_GT(curved->rate_sigma, 3 * straight->rate_sigma);
}

TEST(Drift, TooFewFramesAreAnErrorWithARemedy) {
  auto samples = samples_of({.frames = 2});
  EXPECT_EQ(fit_drift(samples, options()).error().kind, ErrorKind::bad_input);
  samples.push_back(samples.back());
  for (PhaseSample& s : samples) s.at = TimePoint{};
  EXPECT_FALSE(fit_drift(samples, options()).ok());
}

Drift drift_of(double rows, double ppm, double ppm_sigma) {
  Drift drift;
  drift.tau = wrap_positive(Rows(rows) * kDriftRow, kDriftPeriod);
  drift.rate = PartsPerMillion(ppm);
  drift.rate_sigma = PartsPerMillion(ppm_sigma);
  return drift;
}

const TimeLeftOptions kTolerance{.tolerance = Rows(100) * kDriftRow, .period = kDriftPeriod};

TEST(TimeLeft, ClosedForm) {
  // 54 ppm is one row a second: from +30 rows to +100 in 70 s, from -30 in 130 s.
  const auto ahead = time_left(drift_of(30, 54, 0), {}, kTolerance);
  EXPECT_NEAR(ahead.expected.value(), 70, 1e-6);
  EXPECT_NEAR(ahead.earliest.value(), 70, 1e-6);
  EXPECT_NEAR(ahead.latest.value(), 70, 1e-6);
  EXPECT_NEAR(time_left(drift_of(-30, 54, 0), {}, kTolerance).expected.value(), 130, 1e-6);
  EXPECT_NEAR(time_left(drift_of(-30, -54, 0), {}, kTolerance).expected.value(), 70, 1e-6);
}

TEST(TimeLeft, CountsFromNow) {
  const TimePoint later = TimePoint{} + Seconds(20);
  EXPECT_NEAR(time_left(drift_of(30, 54, 0), later, kTolerance).expected.value(), 50, 1e-6);
}

TEST(TimeLeft, UncertainRateGivesAnInterval) {
  const auto left = time_left(drift_of(0, 54, 5.4), {}, kTolerance);
  EXPECT_NEAR(left.earliest.value(), 100 / 1.2, 0.01);
  EXPECT_NEAR(left.latest.value(), 100 / 0.8, 0.01);
}

TEST(TimeLeft, ARateThatMayBeZeroMayLastForEver) {
  const auto left = time_left(drift_of(0, 1, 5), {}, kTolerance);
  EXPECT_TRUE(std::isfinite(left.expected.value()));
  EXPECT_TRUE(std::isinf(left.latest.value()));
  EXPECT_TRUE(std::isinf(time_left(drift_of(0, 0, 0), {}, kTolerance).expected.value()));
}

TEST(TimeLeft, OutsideIsNoTimeAtAll) {
  EXPECT_EQ(time_left(drift_of(120, -54, 1), {}, kTolerance).latest.value(), 0);
}

}  // namespace
}  // namespace emberlock::smear
