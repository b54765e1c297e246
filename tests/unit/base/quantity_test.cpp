// SPDX-License-Identifier: Apache-2.0
#include "base/quantity.h"

#include <gtest/gtest.h>

#include "base/time_point.h"

namespace emberlock {
namespace {

TEST(Quantity, RowsTimesTimePerRowIsTime) {
  EXPECT_DOUBLE_EQ(in_milliseconds(Rows(100) * microseconds_per_row(54)), 5.4);  // the paper's tolerance
  EXPECT_DOUBLE_EQ((milliseconds(5.4) / microseconds_per_row(54)).value(), 100);
  EXPECT_DOUBLE_EQ((milliseconds(5.4) / Rows(100)).value(), 54e-6);
}

TEST(Quantity, OpticalDepthIsPlainNumber) { EXPECT_DOUBLE_EQ(PerMeter(32.8) * Meters(0.2), 6.56); }

TEST(Wrap, SmallNegativeDoesNotRoundUpToTheModulus) {
  EXPECT_EQ(wrap_positive(-1e-20, 1.0), 0);
  EXPECT_EQ(wrap_positive(Seconds(-1e-20), Seconds(1)), Seconds(0));
}

TEST(Wrap, HalfAPeriodIsNegativeHalf) {
  EXPECT_EQ(wrap_symmetric(0.5, 1.0), -0.5);
  EXPECT_EQ(wrap_symmetric(-0.5, 1.0), -0.5);
}

TEST(TimePoint, KeepsNanosecondsOverADay) {
  const TimePoint start{1'700'000'000'000'000'000};
  const TimePoint later = start + Seconds(86400) + nanoseconds(1);
  EXPECT_EQ(later.ns - start.ns, 86'400'000'000'001);
}

}  // namespace
}  // namespace emberlock
