// SPDX-License-Identifier: Apache-2.0
#include "tests/support/time_limit.h"

#include <thread>

#include <gtest/gtest-spi.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace emberlock {
namespace {

/// Works until a clock of its own counts 0.1 s.
void burn(clockid_t clock) {
  timespec now{};
  const auto seconds = [&] {
    ::clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  const double start = seconds();
  while (seconds() < start + 0.1) {
  }
}

void burn_in_child() {
  const pid_t child = ::fork();
  if (child == 0) {
    burn(CLOCK_PROCESS_CPUTIME_ID);
    ::_exit(0);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
}

void burn_in_thread() {
  std::thread([] { burn(CLOCK_THREAD_CPUTIME_ID); }).join();
}

struct Work {
  const char* name;
  void (*act)();
};

class TimeLimit : public testing::TestWithParam<Work> {};

TEST_P(TimeLimit, CountsProcessorTime) {
  const double start = test::processor_seconds();
  GetParam().act();
  EXPECT_GE(test::processor_seconds(), start + 0.09);
}

TEST_P(TimeLimit, FailsATestThatTookMore) {
  const testing::TestSuite& suite = *testing::UnitTest::GetInstance()->current_test_suite();
  const testing::TestInfo& info = *testing::UnitTest::GetInstance()->current_test_info();
  test::TimeLimit limit(0.09);
  limit.OnTestSuiteStart(suite);
  GetParam().act();
  EXPECT_NONFATAL_FAILURE(limit.OnTestEnd(info), "a test of the fast tier has 0.09. Make it smaller or end");
  limit.OnTestEnd(info);
  test::TimeLimit none(0);
  none.OnTestSuiteStart(suite);
  GetParam().act();
  none.OnTestEnd(info);
}

INSTANTIATE_TEST_SUITE_P(By, TimeLimit,
                         testing::Values(Work{"thread", burn_in_thread}, Work{"child", burn_in_child}),
                         [](const auto& test) { return test.param.name; });

TEST(TimeLimit, KnowsTheTiersByTheSuitesName) {
  for (const char* slow : {"EffectsSlow", "SweepNightly", "Devices/EffectsSlow", "EffectsSlow/0"})
    EXPECT_TRUE(test::TimeLimit::is_slow(slow)) << slow;
  for (const char* fast : {"Effects", "SlowDisk", "Devices/Effects"})
    EXPECT_FALSE(test::TimeLimit::is_slow(fast)) << fast;
}

}  // namespace
}  // namespace emberlock
