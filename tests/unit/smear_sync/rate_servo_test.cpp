// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/rate_servo.h"

#include <gtest/gtest.h>

namespace emberlock::smear {
namespace {

const FrameRateTrim kCamera{PartsPerMillion(100), PartsPerMillion(0.5), milliseconds(80)};

ServoStep step(double error_us, double holding_ppm, double sigma_us = 5) {
  return rate_servo({microseconds(error_us), microseconds(sigma_us), PartsPerMillion(holding_ppm)}, kCamera,
                    Seconds(0.5));
}

TEST(RateServo, GoesAtFullRateWhileTheTargetIsFar) {
  EXPECT_EQ(step(5000, 3).trim, PartsPerMillion(100));
  EXPECT_EQ(step(-5000, 3).trim, PartsPerMillion(-100));
  EXPECT_EQ(step(5000, 3).state, ServoState::slewing);
}

TEST(RateServo, TheStepThatArrivesIsNoLongerThanTheWay) {
  const ServoStep last = step(20, 3);  // 20 us in half a second are 40 ppm
  EXPECT_EQ(last.state, ServoState::settling);
  EXPECT_EQ(last.trim, PartsPerMillion(43));
}

TEST(RateServo, WithinItsNoiseAnErrorIsHardlyFollowed) {
  const ServoStep there = step(8, 3);
  EXPECT_EQ(there.state, ServoState::locked);
  EXPECT_EQ(there.trim, PartsPerMillion(7));
}

TEST(RateServo, TrimsAreStepsWithinTheRange) {
  for (double error = -900; error <= 900; error += 7.3) {
    const double trim = step(error, 11.2).trim.value();
    EXPECT_LE(std::abs(trim), 100);
    EXPECT_DOUBLE_EQ(trim, std::round(trim / 0.5) * 0.5);
  }
}

}  // namespace
}  // namespace emberlock::smear
