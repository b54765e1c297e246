// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/sensors/exposure_sweep.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"
#include "tests/support/shutters.h"

namespace emberlock::smear {
namespace {

using test::Shutter;
using testing::HasSubstr;

constexpr double kSweepPeriod = test::kShutterPeriod;

double off(Seconds a, double b) { return wrap_symmetric(a.value() - b, kSweepPeriod); }

TEST(ExposureSweep, BothEdgesWithinTheirSigmas) {
  int inside = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    RandomStream random(seed, 8);
    Shutter s{.end = random.uniform(0, kSweepPeriod),
              .exposure = random.uniform(0.1, 0.9) * kSweepPeriod,
              .seed = seed};
    const auto samples = s.sweep(microseconds(2));
    EXPECT_LT(samples.size(), 60U);
    const auto window = fit_exposure(samples, s.options());
    ASSERT_TRUE(window.ok()) << window.error().message();
    EXPECT_LE(window->end_sigma, microseconds(2));
    EXPECT_LT(std::abs(off(window->end, s.end)), 5e-6);
    EXPECT_LT(std::abs(off(window->begin, s.end - s.exposure)), 5e-6);
    inside += std::abs(off(window->end, s.end)) <= 2 * window->end_sigma.value() ? 1 : 0;
    inside += std::abs(off(window->begin, s.end - s.exposure)) <= 2 * window->begin_sigma.value() ? 1 : 0;
    count += 2;
  }
  EXPECT_GE(inside, 0.88 * count);
}

TEST(ExposureSweep, TheEndAloneIsLookedForWhereItIsThePhase) {
  const Shutter s;
  const auto both = s.sweep(microseconds(2));
  const auto end = s.sweep(microseconds(2), SweepEdges::end);
  EXPECT_LE(end.size() + 3, both.size());
  const auto window = fit_exposure(end, s.options());
  ASSERT_TRUE(window.ok());
  EXPECT_LE(window->end_sigma, microseconds(2));
  EXPECT_LT(std::abs(off(window->end, s.end)), 4 * window->end_sigma.value());
  EXPECT_GT(window->begin_sigma.value(), kSweepPeriod / 24 / 4) << "as the even delays left it";
}

TEST(ExposureSweep, ACoarseSweepSaysHowCoarse) {
  const Shutter s;
  std::vector<SweepSample> samples;
  for (const Seconds d : next_delays({}, s.options(), {})) samples.push_back(s.film(d));
  const auto window = fit_exposure(samples, s.options());
  ASSERT_TRUE(window.ok());
  EXPECT_NEAR(window->end_sigma.value(), kSweepPeriod / 24 / std::sqrt(12.0), 1e-5);
  EXPECT_LT(std::abs(off(window->end, s.end)), 2 * window->end_sigma.value());
}

TEST(ExposureSweep, TheWindowLiesAcrossTheWrap) {
  const Shutter s{.end = 0.001, .exposure = 4e-3};
  const auto window = fit_exposure(s.sweep(microseconds(5)), s.options());
  ASSERT_TRUE(window.ok());
  EXPECT_NEAR(off(window->begin, 0.001 - 4e-3), 0, 10e-6);
}

TEST(ExposureSweep, SaturatedPicturesTellEdgesBetweenDelaysOnly) {
  for (std::uint64_t seed = 1; seed <= 50; ++seed) {
    RandomStream random(seed, 8);
    const Shutter s{.end = random.uniform(0, kSweepPeriod), .white = random.uniform(15, 90), .seed = seed};
    const auto samples = s.sweep(microseconds(2));
    EXPECT_LT(samples.size(), 60U) << "what can't be told finer isn't filmed again and again";
    const auto window = fit_exposure(samples, s.options());
    ASSERT_TRUE(window.ok());
    EXPECT_TRUE(window->saturated);
    EXPECT_LE(window->end_sigma.value(), s.width / 3);
    EXPECT_LT(std::abs(off(window->end, s.end)), 2 * window->end_sigma.value());
    EXPECT_LT(std::abs(off(window->begin, s.end - s.exposure)), 2 * window->begin_sigma.value());
  }
}

TEST(ExposureSweep, AnExposureOfThePeriodOrAFlashOutOfViewIsRefused) {
  for (const Shutter& s : {Shutter{.exposure = kSweepPeriod}, Shutter{.flash = 0}}) {
    const auto window = fit_exposure(s.sweep(microseconds(5)), s.options());
    ASSERT_FALSE(window.ok());
    EXPECT_THAT(window.error().remedy, HasSubstr("shorten an exposure"));
  }
  EXPECT_FALSE(fit_exposure({}, {}).ok());
}

TEST(ExposureSweep, LightThatComesAndGoesIsRefused) {
  const Shutter s;
  auto samples = s.sweep(milliseconds(1));
  samples[15].level = s.ambient + s.flash;
  samples[18].level = s.ambient + s.flash;
  const auto window = fit_exposure(samples, s.options());
  ASSERT_FALSE(window.ok());
  EXPECT_THAT(window.error().what, HasSubstr("alternate"));
}

TEST(ExposureSweep, PhasesOfTwoShuttersCompareLikeAnyOthers) {
  const Shutter a{.end = 0.0040};
  const Shutter b{.end = 0.0047, .exposure = 2e-3, .seed = 2};
  const auto wa = fit_exposure(a.sweep(microseconds(2)), a.options());
  const auto wb = fit_exposure(b.sweep(microseconds(2)), b.options());
  ASSERT_TRUE(wa.ok() && wb.ok());
  const Seconds delay(0.009);
  const Seconds error = phase_error(phase_of(*wa, delay, Seconds(kSweepPeriod)),
                                    phase_of(*wb, delay, Seconds(kSweepPeriod)), Seconds(kSweepPeriod));
  EXPECT_NEAR(error.value(), 0.0007, 5e-6);  // a reads earlier
}

}  // namespace
}  // namespace emberlock::smear
