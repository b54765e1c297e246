// SPDX-License-Identifier: Apache-2.0
#include "base/result.h"

#include <gtest/gtest.h>

namespace emberlock {
namespace {

Result<int> half(int n) {
  if (n % 2 != 0) return Error{ErrorKind::bad_input, "odd", "n", "Give an even number"};
  return n / 2;
}
Result<int> quarter(int n) {
  EMBERLOCK_ASSIGN_OR_RETURN(const int h, half(n));
  EMBERLOCK_ASSIGN_OR_RETURN(const int q, half(h));
  return q;
}
Status check(int n) {
  EMBERLOCK_RETURN_IF_ERROR(quarter(n));
  return {};
}

TEST(Result, ErrorsPassThroughWithTheirWords) {
  EXPECT_EQ(quarter(8).value(), 2);
  ASSERT_FALSE(quarter(6).ok());
  EXPECT_EQ(quarter(6).error().message(), "n: odd. Give an even number");
  EXPECT_TRUE(check(4).ok());
  EXPECT_FALSE(check(2).ok());
}

TEST(Result, TheRemedyIsASentence) {
  const Error error{ErrorKind::bad_input, "has no unit", "tolerance '5'", "give a number with its unit"};
  EXPECT_EQ(error.message(), "tolerance '5': has no unit. Give a number with its unit");
}

TEST(Result, TheAbsentValueIsALogicError) {
  EXPECT_THROW((void)half(3).value(), std::bad_variant_access);
  EXPECT_THROW((void)half(2).error(), std::bad_variant_access);
}

TEST(Result, AMessageOfAForeignTextHasABound) {
  const std::string huge(100'000'000, 'x');
  const Error error{ErrorKind::bad_input, huge, huge, "Do this"};
  EXPECT_LT(error.message().size(), 5000U);
  EXPECT_TRUE(error.message().ends_with("x.... Do this"));
}

}  // namespace
}  // namespace emberlock
