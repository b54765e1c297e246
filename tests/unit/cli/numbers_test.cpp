// SPDX-License-Identifier: Apache-2.0
#include "cli/numbers.h"

#include <gtest/gtest.h>

namespace emberlock::cli {
namespace {

TEST(Numbers, StandBetweenCommasAndBlanksDontCount) {
  using Three = std::array<double, 3>;
  EXPECT_EQ(parse_numbers_of<3>("1,2,3"), (Three{1, 2, 3}));
  EXPECT_EQ(parse_numbers_of<3>(" 0, -0.5 ,1e3 "), (Three{0, -0.5, 1000}));
  for (const char* bad :
       {"", "1,2", "1,2,3,4", "1,2,3,", ",1,2", "1,,3", "1 2 3", "1,2,x", "1,2,inf", "1,2,nan", "1e300,2,3"})
    EXPECT_FALSE(parse_numbers_of<3>(bad).has_value()) << bad;
}

}  // namespace
}  // namespace emberlock::cli
