// SPDX-License-Identifier: Apache-2.0
#include "cli/interrupt.h"

#include <gtest/gtest.h>

namespace emberlock::cli {
namespace {

TEST(Interrupt, TheFirstCtrlCOnlyAsksToStopAndTheNextOneKills) {
  EXPECT_FALSE(Interrupt::asked());
  const Interrupt interrupt;
  EXPECT_FALSE(Interrupt::asked());
  ASSERT_EQ(std::raise(SIGINT), 0);
  EXPECT_TRUE(Interrupt::asked());
  struct sigaction now {};
  ASSERT_EQ(::sigaction(SIGINT, nullptr, &now), 0);
  EXPECT_EQ(now.sa_handler, SIG_DFL);
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

}  // namespace
}  // namespace emberlock::cli
