// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <stdexcept>
#include <utility>

#include <gmock/gmock.h>

#include "base/result.h"

namespace emberlock {

/// The value of a result; without one the test fails with the error's message.
template <class T>
T value_of(Result<T> result) {
  if (!result.ok()) throw std::runtime_error(result.error().message());
  return std::move(result).value();
}

MATCHER_P(FailsWithMessage, message,
          "fails, and its message " + testing::DescribeMatcher<std::string>(message)) {
  if (arg.ok()) *result_listener << "which has no error";
  return !arg.ok() && testing::ExplainMatchResult(message, arg.error().message(), result_listener);
}

/// Matches a Result or a Status whose error's message contains each of the words.
template <class... Words>
auto FailsWith(const Words&... words) {
  return FailsWithMessage(testing::AllOf(testing::HasSubstr(words)...));
}

}  // namespace emberlock
