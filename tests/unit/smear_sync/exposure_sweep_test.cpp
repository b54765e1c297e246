#include "smear_sync/exposure_sweep.h"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/random.h"

namespace emberlock {
namespace {

using testing::HasSubstr;

constexpr double kPeriod = 1 / 60.0;

/// A global shutter that gathers [end - exposure, end) of every period.
struct Shutter {
  double end = 0.0031;
  double exposure = 5e-3;
  double ambient = 12;
  double flash = 80;
  double noise = 0.5;
  double width = 20e-6;
  double white = 1e9;
  std::uint64_t seed = 1;

  [[nodiscard]] SweepSample film(Seconds delay) const {
    double light = 0;
    for (int turn = -1; turn <= 2; ++turn) {
      const double begin = delay.value() - width / 2 + turn * kPeriod;
      light +=
          std::max(0.0, std::min(begin + width, end + kPeriod) - std::max(begin, end + kPeriod - exposure)) /
          width;
    }
    const auto counter = static_cast<std::uint64_t>(std::llround(delay.value() * 1e9));
    const double level = ambient + flash * light + noise * random_normal(seed, 5, counter);
    return {delay, std::min(level, white), noise};
  }
  /// Films what next_delays() asks for, to the end.
  [[nodiscard]] std::vector<SweepSample> sweep(Seconds resolution) const {
    std::vector<SweepSample> samples;
    for (int round = 0; round < 40; ++round) {
      const auto delays = next_delays(samples, options(), resolution);
      if (delays.empty()) break;
      for (const Seconds d : delays) samples.push_back(film(d));
    }
    return samples;
  }
  [[nodiscard]] SweepOptions options() const {
    return {.period = Seconds(kPeriod), .flash_width = Seconds(width)};
  }
};

double off(Seconds a, double b) { return wrap_symmetric(a.value() - b, kPeriod); }

TEST(ExposureSweep, BothEdgesWithinTheirSigmas) {
  int inside = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    RandomStream random(seed, 8);
    Shutter s{
        .end = random.uniform(0, kPeriod), .exposure = random.uniform(0.1, 0.9) * kPeriod, .seed = seed};
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

TEST(ExposureSweep, ACoarseSweepSaysHowCoarse) {
  const Shutter s;
  std::vector<SweepSample> samples;
  for (const Seconds d : next_delays({}, s.options(), {})) samples.push_back(s.film(d));
  const auto window = fit_exposure(samples, s.options());
  ASSERT_TRUE(window.ok());
  EXPECT_NEAR(window->end_sigma.value(), kPeriod / 24 / std::sqrt(12.0), 1e-5);
  EXPECT_LT(std::abs(off(window->end, s.end)), 2 * window->end_sigma.value());
}

TEST(ExposureSweep, TheWindowLiesAcrossTheWrap) {
  const Shutter s{.end = 0.001, .exposure = 4e-3};
  const auto window = fit_exposure(s.sweep(microseconds(5)), s.options());
  ASSERT_TRUE(window.ok());
  EXPECT_NEAR(off(window->begin, 0.001 - 4e-3), 0, 10e-6);
}

TEST(ExposureSweep, SaturatedPicturesTellEdgesBetweenDelaysOnly) {
  const Shutter s{.white = 40};
  const auto window = fit_exposure(s.sweep(microseconds(40)), s.options(), 40.0);
  ASSERT_TRUE(window.ok());
  EXPECT_TRUE(window->saturated);
  EXPECT_LT(std::abs(off(window->end, s.end)), 2 * window->end_sigma.value() + s.width);
}

TEST(ExposureSweep, AnExposureOfThePeriodOrAFlashOutOfViewIsRefused) {
  for (const Shutter& s : {Shutter{.exposure = kPeriod}, Shutter{.flash = 0}}) {
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
  const Seconds error = phase_error(phase_of(*wa, delay, Seconds(kPeriod)),
                                    phase_of(*wb, delay, Seconds(kPeriod)), Seconds(kPeriod));
  EXPECT_NEAR(error.value(), 0.0007, 5e-6);  // a reads earlier
}

}  // namespace
}  // namespace emberlock
