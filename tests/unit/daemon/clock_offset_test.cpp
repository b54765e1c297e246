// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/clock_offset.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

namespace emberlock::daemon {
namespace {

constexpr std::int64_t kAhead = 5'000'000'000'123;

TimePoint ms(double t) { return {static_cast<std::int64_t>(t * 1e6)}; }

TEST(ClockOffset, BeforeTheFirstAnswerNothingIsKnown) {
  const ClockOffset offset;
  EXPECT_FALSE(offset.reading(ms(1)));
  EXPECT_FALSE(offset.round_trip());
}

TEST(ClockOffset, OfTwoWaysTheSameLengthItIsExact) {
  ClockOffset offset;
  offset.add(ms(10), {ms(11).ns + kAhead}, ms(12));
  const auto reading = offset.reading(ms(12));
  ASSERT_TRUE(reading);
  EXPECT_EQ(reading->ahead_ns(), kAhead);
  EXPECT_EQ(reading->at_ns(), ms(12).ns);
  EXPECT_EQ(reading->sigma_ns(), 1'000'000);
  EXPECT_EQ(*offset.round_trip(), milliseconds(2));
}

RC_GTEST_PROP(ClockOffsetProperty, ItIsNeverFurtherOffThanItSays, ()) {
  ClockOffset offset;
  double now = 0;
  // A clock that runs 60 ppm fast, and ways of any length.
  const auto there = [](double t) { return TimePoint{ms(t * (1 + 60e-6)).ns + kAhead}; };
  const int questions = *rc::gen::inRange(1, 40);
  for (int i = 0; i < questions; ++i) {
    const double way = *rc::gen::inRange(1, 2000) * 0.01;
    const double back = *rc::gen::inRange(1, 2000) * 0.01;
    offset.add(ms(now), there(now + way), ms(now + way + back));
    now += way + back + 250;
  }
  const auto reading = offset.reading(ms(now));
  RC_ASSERT(reading.has_value());
  const std::int64_t truth = there(now).ns - ms(now).ns;
  RC_ASSERT(std::abs(reading->ahead_ns() - truth) <= reading->sigma_ns() + 1000);
}

TEST(ClockOffset, OneQuickAnswerCountsMoreThanSlowNewerOnes) {
  ClockOffset offset;
  offset.add(ms(0), {ms(0.1).ns + kAhead}, ms(0.2));
  offset.add(ms(250), {ms(289).ns + kAhead}, ms(290));  // stood 38 ms on its way there
  EXPECT_NEAR(static_cast<double>(offset.reading(ms(290))->ahead_ns() - kAhead), 0, 1000);
}

TEST(ClockOffset, OldAnswersAreForgotten) {
  ClockOffset offset;
  offset.add(ms(0), ms(0.1), ms(0.2));
  for (std::size_t i = 1; i <= ClockOffset::kKept; ++i) {
    const double t = 250.0 * static_cast<double>(i);
    offset.add(ms(t), {ms(t + 1).ns + kAhead}, ms(t + 2));
  }
  EXPECT_NEAR(static_cast<double>(offset.reading(ms(2500))->ahead_ns() - kAhead), 0, 1000);
}

TEST(ClockOffset, OfAMachineThatWasStartedAnewTheOldAnswersAreForgottenAtOnce) {
  ClockOffset offset;
  offset.add(ms(0), {ms(0.1).ns + kAhead}, ms(0.2));
  offset.add(ms(5000), ms(5060), ms(5120));  // the first answer after it takes long
  EXPECT_NEAR(static_cast<double>(offset.reading(ms(5120))->ahead_ns()), 0, 60e6);
}

TEST(ClockOffset, AnAnswerHeardBeforeItWasAskedIsLeftOut) {
  ClockOffset offset;
  offset.add(ms(10), ms(10), ms(9));
  EXPECT_FALSE(offset.reading(ms(10)));
}

}  // namespace
}  // namespace emberlock::daemon
