// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "drivers/v4l2/frame_numbers.h"

namespace emberlock::drivers {
namespace {

constexpr Seconds kPeriod = milliseconds(40);

TimePoint at(double periods) { return TimePoint{} + kPeriod * periods; }

TEST(V4l2FrameNumbers, CountOnAcrossStarts) {
  FrameNumbers numbers(kPeriod);
  EXPECT_EQ(numbers.next(0, at(0)).frame_id, 0U);
  EXPECT_EQ(numbers.next(1, at(1)).frame_id, 1U);
  numbers.restart();
  const auto first = numbers.next(5, at(20));
  EXPECT_EQ(first.frame_id, 2U);
  EXPECT_EQ(first.missing, 0U);
}

TEST(V4l2FrameNumbers, TellASkipForWhichTimeHasPassed) {
  FrameNumbers numbers(kPeriod);
  (void)numbers.next(7, at(0));
  const auto after = numbers.next(10, at(3.1));
  EXPECT_EQ(after.missing, 2U);
  EXPECT_EQ(after.frame_id, 3U);
}

TEST(V4l2FrameNumbers, BelieveASkipAfterALateFrame) {
  FrameNumbers numbers(kPeriod);
  (void)numbers.next(0, at(0.6));
  EXPECT_EQ(numbers.next(2, at(2)).missing, 1U);
}

TEST(V4l2FrameNumbers, CountNoFrameForWhichThereWasNoTime) {
  FrameNumbers numbers(kPeriod);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const auto number = numbers.next(2 * i, at(i));
    EXPECT_EQ(number.missing, 0U) << i;
    EXPECT_EQ(number.frame_id, i);
  }
}

TEST(V4l2FrameNumbers, TellASkipOfACameraThatFilmsFasterThanItSaid) {
  FrameNumbers numbers(2 * kPeriod);
  std::uint32_t i = 0;
  for (; i < 100; ++i) EXPECT_EQ(numbers.next(i, at(i)).missing, 0U);
  EXPECT_EQ(numbers.next(i + 1, at(i + 1)).missing, 1U);
}

TEST(V4l2FrameNumbers, TellASkipAfterALongPause) {
  FrameNumbers numbers(kPeriod);
  (void)numbers.next(0, at(0));
  EXPECT_EQ(numbers.next(1, at(500)).missing, 0U);
  EXPECT_EQ(numbers.next(3, at(502)).missing, 1U);
}

TEST(V4l2FrameNumbers, WrapAsTheKernelsDo) {
  FrameNumbers numbers(kPeriod);
  (void)numbers.next(0xffffffff, at(0));
  EXPECT_EQ(numbers.next(0, at(1)).missing, 0U);
  EXPECT_EQ(numbers.next(2, at(3)).missing, 1U);
}

TEST(V4l2FrameNumbers, TakeAStepBackAsNoSkip) {
  FrameNumbers numbers(kPeriod);
  (void)numbers.next(10, at(0));
  EXPECT_EQ(numbers.next(3, at(100)).missing, 0U);
}

TEST(V4l2FrameNumbers, BelieveTheSequenceWhereThePeriodIsUnknown) {
  FrameNumbers numbers(Seconds(0));
  (void)numbers.next(0, at(0));
  EXPECT_EQ(numbers.next(9, at(0.1)).missing, 8U);
}

}  // namespace
}  // namespace emberlock::drivers
