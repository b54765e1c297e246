// SPDX-License-Identifier: Apache-2.0
// The main function of the test programs: GoogleTest's, with a limit on each test's processor time, which
// ctest sets for the fast tier: EMBERLOCK_TEST_SECONDS.
#include "tests/support/time_limit.h"

#include <cstdlib>

#include <gmock/gmock.h>

int main(int argc, char** argv) {
  testing::InitGoogleMock(&argc, argv);
  const char* const given = std::getenv("EMBERLOCK_TEST_SECONDS");
  testing::UnitTest::GetInstance()->listeners().Append(
      new emberlock::test::TimeLimit(given != nullptr ? std::strtod(given, nullptr) : 0));
  return RUN_ALL_TESTS();
}
