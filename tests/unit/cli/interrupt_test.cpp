// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <cstdlib>

#include <gtest/gtest.h>

namespace emberlock::cli {
namespace {

TEST(Interrupt, TheFirstCtrlCOnlyAsksToStop) {
  EXPECT_FALSE(Interrupt::asked());
  const Interrupt interrupt;
  EXPECT_FALSE(Interrupt::asked());
  ASSERT_EQ(std::raise(SIGINT), 0);
  EXPECT_TRUE(Interrupt::asked());
}

/// A second Ctrl-C some time after the first, by a clock that stands still meanwhile.
void ask_twice(Interrupt::Clock::duration apart) {
  static Interrupt::Clock::time_point now(std::chrono::hours(1));
  const Interrupt interrupt(Interrupt::Heeds::ctrl_c, [] { return now; });
  std::raise(SIGINT);
  now += apart;
  std::raise(SIGINT);
  std::_Exit(Interrupt::asked() ? 0 : 1);
}

TEST(InterruptDeathTest, ACtrlCThatArrivesTwiceCountsOnce) {
  for (const auto apart : {std::chrono::milliseconds(0), std::chrono::milliseconds(1000)})
    EXPECT_EXIT(ask_twice(apart), testing::ExitedWithCode(0), "");
}

TEST(InterruptDeathTest, AnotherOneLaterKills) {
  EXPECT_EXIT(ask_twice(std::chrono::milliseconds(1001)), testing::KilledBySignal(SIGINT), "");
}

TEST(Interrupt, WhatWasAskedForEndsWithIt) {
  {
    const Interrupt interrupt;
    ASSERT_EQ(std::raise(SIGINT), 0);
    ASSERT_TRUE(Interrupt::asked());
  }
  EXPECT_FALSE(Interrupt::asked()) << "the next run isn't stopped by an old Ctrl-C";
}

TEST(Interrupt, TheHandlerThatWasThereIsPutBack) {
  struct sigaction before {};
  ASSERT_EQ(::sigaction(SIGINT, nullptr, &before), 0);
  { const Interrupt interrupt; }
  struct sigaction after {};
  ASSERT_EQ(::sigaction(SIGINT, nullptr, &after), 0);
  EXPECT_EQ(after.sa_handler, before.sa_handler);
}

TEST(Interrupt, HeedsTerminationWhereItWasToldTo) {
  struct sigaction before {
  }, after{};
  ASSERT_EQ(::sigaction(SIGTERM, nullptr, &before), 0);
  {
    const Interrupt interrupt(Interrupt::Heeds::termination_too);
    ASSERT_EQ(std::raise(SIGTERM), 0);
    EXPECT_TRUE(Interrupt::asked());
  }
  ASSERT_EQ(::sigaction(SIGTERM, nullptr, &after), 0);
  EXPECT_EQ(after.sa_handler, before.sa_handler);
}

}  // namespace
}  // namespace emberlock::cli
