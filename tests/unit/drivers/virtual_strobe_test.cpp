// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/virtual_strobe.h"

#include <cmath>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/virtual/virtual_clock.h"

namespace emberlock::drivers {
namespace {

using testing::HasSubstr;

class VirtualStrobeThreads : public testing::Test {
 protected:
  std::vector<double> flashes(double from, double to) const {
    std::vector<double> begins;
    for (const LightPulse& p : timeline_->light(TimePoint{}, Seconds(from), Seconds(to)))
      begins.push_back(p.begin.value());
    return begins;
  }
  void expect_refused(const StrobeSettings& settings, const char* what) {
    const Status status = strobe_.apply(settings);
    ASSERT_FALSE(status.ok());
    EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(status.error().what, HasSubstr(what));
    EXPECT_THAT(status.error().where, HasSubstr("lab strobe"));
    EXPECT_FALSE(status.error().remedy.empty());
  }

  std::shared_ptr<VirtualClock> clock_ = std::make_shared<VirtualClock>();
  std::shared_ptr<StrobeTimeline> timeline_ = std::make_shared<StrobeTimeline>(PartsPerMillion(0));
  VirtualStrobe strobe_{{.id = "lab strobe"}, clock_, timeline_};
};

constexpr auto kFlashing = StrobeOutput::flashing;

TEST_F(VirtualStrobeThreads, RateIsRoundedToATenthOfAFlashAMinute) {
  ASSERT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(23.976)}).ok());
  EXPECT_DOUBLE_EQ(strobe_.read_back().value().rate.value() * 60, 1438.6);
  EXPECT_NEAR(flashes(1, 2).at(1) - flashes(1, 2).at(0), 60 / 1438.6, 1e-12);
}

TEST_F(VirtualStrobeThreads, TheWholeRangeOfRatesIsAccepted) {
  for (const double rate : {0.5, 333.3, 20000.0 / 60}) {
    EXPECT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(rate)}).ok()) << rate;
  }
}

TEST_F(VirtualStrobeThreads, ReadBackOfRoundedSettingsIsAcceptedAgain) {
  const double longest = 1 / 333.3;
  ASSERT_TRUE(strobe_
                  .apply({.rate = Hertz(333.3),
                          .phase = Seconds(longest * 0.9999999),
                          .width = Seconds(longest * 0.9999999)})
                  .ok());
  const StrobeSettings once = strobe_.read_back().value();
  ASSERT_TRUE(strobe_.apply(once).ok());
  EXPECT_EQ(strobe_.read_back().value(), once);
}

TEST_F(VirtualStrobeThreads, SettingsOutOfRangeAreRefusedWithTheRange) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double rate : {0.49, 334.0, 0.0, -1.0, nan}) expect_refused({.rate = Hertz(rate)}, "rate");
  for (const double phase : {-1e-6, 0.1, nan})
    expect_refused({.rate = Hertz(10), .phase = Seconds(phase)}, "phase");
  for (const double width : {0.0, -1e-6, 0.1, nan})
    expect_refused({.rate = Hertz(10), .width = Seconds(width)}, "width");
  expect_refused({.code = std::vector<bool>(4097)}, "code");
}

TEST_F(VirtualStrobeThreads, RefusedSettingsChangeNothing) {
  ASSERT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(10)}).ok());
  ASSERT_FALSE(strobe_.apply({.output = kFlashing, .rate = Hertz(1000)}).ok());
  EXPECT_EQ(strobe_.read_back().value().rate, Hertz(10));
  EXPECT_EQ(flashes(0, 1).size(), 10U);
}

TEST_F(VirtualStrobeThreads, AChangedPhaseMovesTheFlashesByTheDifference) {
  ASSERT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(10), .phase = Seconds(0.02)}).ok());
  clock_->sleep_until({1'037'000'000});
  ASSERT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(10), .phase = Seconds(0.05)}).ok());
  const auto begins = flashes(0.95, 1.3);
  ASSERT_EQ(begins.size(), 4U);
  const double expected[] = {1.02, 1.05, 1.15, 1.25};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(begins[i], expected[i], 1e-12);
}

TEST_F(VirtualStrobeThreads, AChangedRateBeginsAnewWhenItIsApplied) {
  ASSERT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(10)}).ok());
  clock_->sleep_until({1'037'000'000});
  ASSERT_TRUE(strobe_.apply({.output = kFlashing, .rate = Hertz(20)}).ok());
  const auto begins = flashes(0.95, 1.1);
  ASSERT_EQ(begins.size(), 3U);
  EXPECT_NEAR(begins[0], 1.0, 1e-12);
  EXPECT_NEAR(begins[1], 1.037, 1e-12);
  EXPECT_NEAR(begins[2], 1.087, 1e-12);
}

TEST_F(VirtualStrobeThreads, ACodeSkipsFlashesAndRepeats) {
  ASSERT_TRUE(
      strobe_.apply({.output = kFlashing, .rate = Hertz(10), .code = {true, false, false, true}}).ok());
  const auto begins = flashes(0, 0.8);
  ASSERT_EQ(begins.size(), 4U);
  const double expected[] = {0, 0.3, 0.4, 0.7};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(begins[i], expected[i], 1e-12);
}

TEST_F(VirtualStrobeThreads, OffGivesNoLightAndSteadyGivesItWithoutAGap) {
  EXPECT_TRUE(flashes(0, 10).empty());
  ASSERT_TRUE(strobe_.apply({.output = StrobeOutput::steady}).ok());
  clock_->sleep_until({2'000'000'000});
  ASSERT_TRUE(strobe_.apply({.output = StrobeOutput::off}).ok());
  const auto light = timeline_->light(TimePoint{}, Seconds(-1), Seconds(5));
  ASSERT_EQ(light.size(), 1U);
  EXPECT_EQ(light[0].begin, Seconds(0));
  EXPECT_EQ(light[0].width, Seconds(2));
}

TEST(StrobeTimeline, RateErrorIsInTheLightAndNotInTheReadBack) {
  StrobeTimeline fast(PartsPerMillion(100));
  fast.apply({.output = kFlashing, .rate = Hertz(10)}, {});
  const auto light = fast.light(TimePoint{}, Seconds(99.95), Seconds(100.05));
  ASSERT_EQ(light.size(), 1U);
  EXPECT_NEAR(std::remainder(light[0].begin.value() * 10 * 1.0001, 1.0), 0, 1e-9);
}

TEST(StrobeTimeline, AFlashThatStraddlesTheWindowCounts) {
  StrobeTimeline timeline{PartsPerMillion(0)};
  timeline.apply({.output = kFlashing, .rate = Hertz(10), .width = Seconds(0.01)}, {});
  EXPECT_EQ(timeline.light(TimePoint{}, Seconds(0.105), Seconds(0.15)).size(), 1U);
  EXPECT_EQ(timeline.light(TimePoint{}, Seconds(0.1101), Seconds(0.15)).size(), 0U);
}

}  // namespace
}  // namespace emberlock::drivers
