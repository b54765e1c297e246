// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <cstdlib>
#include <thread>

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

TEST(InterruptDeathTest, ACtrlCThatArrivesTwiceCountsOnce) {
  const auto ask_twice = [] {
    const Interrupt interrupt;
    std::raise(SIGINT);
    std::raise(SIGINT);
    std::_Exit(Interrupt::asked() ? 0 : 1);
  };
  EXPECT_EXIT(ask_twice(), testing::ExitedWithCode(0), "");
}

TEST(InterruptDeathTest, AnotherOneLaterKills) {
  const auto ask_twice = [] {
    const Interrupt interrupt;
    std::raise(SIGINT);
    std::this_thread::sleep_for(std::chrono::milliseconds(1100));
    std::raise(SIGINT);
  };
  EXPECT_EXIT(ask_twice(), testing::KilledBySignal(SIGINT), "");
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
