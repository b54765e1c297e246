// SPDX-License-Identifier: Apache-2.0
// The main function of the test programs: GoogleTest's, with a limit on each test's processor time.
#include "tests/support/time_limit.h"

#include <cstdlib>

#include <gmock/gmock.h>

namespace {

/// Sanitizers, a GPU in software and builds without optimisation take several times as long.
#if defined(EMBERLOCK_SANITIZED) || defined(EMBERLOCK_GPU_IN_SOFTWARE) || !defined(NDEBUG)
constexpr double kDefaultLimit = 0;
#else
constexpr double kDefaultLimit = 15;
#endif

}  // namespace

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  const char* const given = std::getenv("EMBERLOCK_TEST_SECONDS");
  testing::UnitTest::GetInstance()->listeners().Append(
      new emberlock::test::TimeLimit(given != nullptr ? std::strtod(given, nullptr) : kDefaultLimit));
  return RUN_ALL_TESTS();
}
