// SPDX-License-Identifier: Apache-2.0
#include "session/host_clock.h"

#include <cstdint>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock::session {
namespace {

using testing::HasSubstr;

constexpr std::int64_t kSecond = 1'000'000'000;

struct Read {
  std::int64_t at_ns;
  std::int64_t ahead_ns;
  std::int64_t sigma_ns = 0;
};

ClockReadings readings_of(const std::vector<Read>& reads) {
  ClockReadings readings;
  for (const Read& read : reads) {
    v1::ClockReading& reading = *readings.Add();
    reading.set_at_ns(read.at_ns);
    reading.set_ahead_ns(read.ahead_ns);
    reading.set_sigma_ns(read.sigma_ns);
  }
  return readings;
}

HostClock clock_of_reads(const std::vector<Read>& reads) {
  auto clock = HostClock::of(readings_of(reads), "test");
  EXPECT_TRUE(clock) << clock.error().message();
  return std::move(clock).value();
}

void expect_wrong(const std::vector<Read>& reads, const std::string& why) {
  const auto clock = HostClock::of(readings_of(reads), "manifest.json, camera left");
  ASSERT_FALSE(clock) << why;
  EXPECT_EQ(clock.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(clock.error().message(), HasSubstr(why));
  EXPECT_THAT(clock.error().where, HasSubstr("camera left"));
}

TEST(HostClock, WithoutReadingsItIsTheSessions) {
  const HostClock clock = clock_of_reads({});
  EXPECT_TRUE(clock.is_the_sessions());
  for (const std::int64_t ns : {std::numeric_limits<std::int64_t>::min(), std::int64_t{-7}, 5 * kSecond,
                                std::numeric_limits<std::int64_t>::max()})
    EXPECT_EQ(clock.on_session({ns}).ns, ns);
}

TEST(HostClock, ByOneReadingItIsAheadByTheSameAtAnyTime) {
  for (const std::int64_t ahead : {5000 * kSecond, -5000 * kSecond}) {
    const HostClock clock = clock_of_reads({{100 * kSecond, ahead}});
    EXPECT_FALSE(clock.is_the_sessions());
    for (const std::int64_t at : {-kSecond, 100 * kSecond, 100'000 * kSecond + 1})
      EXPECT_EQ(clock.on_session({at + ahead}).ns, at);
  }
}

/// By three: from 10 s to 20 s it gains 20 ppm, from then on it loses 40 ppm.
TEST(HostClock, IsLinearBetweenReadingsAndGoesOnOutside) {
  const std::int64_t offset = 5000 * kSecond;
  const HostClock clock = clock_of_reads(
      {{10 * kSecond, offset}, {20 * kSecond, offset + 200'000}, {40 * kSecond, offset - 600'000}});
  const auto expect = [&](std::int64_t at, std::int64_t ahead) {
    EXPECT_NEAR(static_cast<double>(clock.on_session({at + ahead}).ns - at), 0, 1) << at;
  };
  expect(10 * kSecond, offset);
  expect(15 * kSecond, offset + 100'000);
  expect(20 * kSecond, offset + 200'000);
  expect(30 * kSecond, offset - 200'000);
  expect(40 * kSecond, offset - 600'000);
  expect(0, offset - 200'000);               // the first two go on
  expect(60 * kSecond, offset - 1'400'000);  // the last two go on
}

TEST(HostClock, TimeRisesOverAReading) {
  const HostClock clock = clock_of_reads({{0, 0}, {kSecond, 900'000}, {2 * kSecond, 0}});
  std::int64_t before = clock.on_session({1'000'890'000}).ns;
  for (std::int64_t ns = 1'000'890'007; ns < 1'000'910'000; ns += 7) {
    const std::int64_t now = clock.on_session({ns}).ns;
    EXPECT_GE(now, before);
    EXPECT_LE(now - before, 8);
    before = now;
  }
}

TEST(HostClock, OfAMachineThatRunsForYearsItIsExactToTheNanosecond) {
  const std::int64_t year = 365LL * 86400 * kSecond;
  const HostClock clock =
      clock_of_reads({{year, -year / 2}, {year + 1200 * kSecond, -year / 2 + 36'000'000}});
  EXPECT_EQ(clock.on_session({year / 2}).ns, year);
  EXPECT_EQ(clock.on_session({year / 2 + 1200 * kSecond + 36'000'000}).ns, year + 1200 * kSecond);
  EXPECT_NEAR(static_cast<double>(clock.on_session({year / 2 + 600 * kSecond + 18'000'000}).ns - year), 600e9,
              1);
}

/// Stamps of damaged or foreign files may be anything.
TEST(HostClock, NoStampOverflowsIt) {
  const std::int64_t lowest = std::numeric_limits<std::int64_t>::min();
  const std::int64_t highest = std::numeric_limits<std::int64_t>::max();
  const std::int64_t far = (std::int64_t{1} << 60) - 1;
  EXPECT_EQ(clock_of_reads({{-far, -far}}).on_session({highest}).ns, highest);
  EXPECT_EQ(clock_of_reads({{far, far}}).on_session({lowest}).ns, lowest);
  const HostClock fast = clock_of_reads({{0, 0}, {1000, 1}});
  EXPECT_GT(fast.on_session({highest}).ns, highest / 2);
  EXPECT_LT(fast.on_session({lowest}).ns, lowest / 2);
}

TEST(HostClock, WhatNoClockShowsIsRefused) {
  expect_wrong({{0, 0}, {0, 0}}, "reading 1 isn't later");
  expect_wrong({{0, 0}, {2 * kSecond, 0}, {kSecond, 0}}, "reading 2 isn't later");
  expect_wrong({{0, 0}, {kSecond, -2 * kSecond, 9 * kSecond}}, "reading 1 isn't later");
  expect_wrong({{0, 0}, {kSecond, 1'001'000}}, "goes wrong by 1001 ppm");
  expect_wrong({{0, 0}, {kSecond, -1'100'000}}, "goes wrong by -1100 ppm");
  expect_wrong({{std::int64_t{1} << 60, 0}}, "isn't of any clock");
  expect_wrong({{0, std::numeric_limits<std::int64_t>::min()}}, "isn't of any clock");
  expect_wrong({{0, 0, -1}}, "isn't of any clock");
}

/// Of a recording of a tenth of a second: each reading may be wrong by 0.2 ms.
TEST(HostClock, WhatTheReadingsMayBeWrongByIsNotTheClocks) {
  const HostClock clock = clock_of_reads({{0, 0, 200'000}, {kSecond / 10, 400'000, 200'000}});
  EXPECT_EQ(clock.on_session({kSecond / 10 + 400'000}).ns, kSecond / 10);
}

TEST(HostClock, IsSummedUp) {
  const ClockSummary summary = summary_of(readings_of({{0, -5 * kSecond, 100},
                                                       {600 * kSecond, -5 * kSecond + 1, 300'000},
                                                       {1200 * kSecond, -5 * kSecond + 36'000'000, 7}}));
  EXPECT_DOUBLE_EQ(summary.ahead.value(), -5);
  EXPECT_DOUBLE_EQ(summary.drifted.value(), 0.036);
  EXPECT_NEAR(summary.drift.value(), 30, 1e-9);
  EXPECT_DOUBLE_EQ(summary.sigma.value(), 3e-4);
  EXPECT_EQ(summary_of(readings_of({{5, 6, 7}})).drift.value(), 0);
}

}  // namespace
}  // namespace emberlock::session
