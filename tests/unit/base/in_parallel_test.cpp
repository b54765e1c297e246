// SPDX-License-Identifier: Apache-2.0
#include "base/in_parallel.h"

#include <algorithm>
#include <atomic>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace emberlock {
namespace {

using ::testing::Each;
using ::testing::Le;

TEST(InParallel, EachPartIsDoneOnce) {
  for (const std::size_t count : {0, 1, 2, 7, 100}) {
    std::vector<std::atomic<int>> done(count);
    EXPECT_TRUE(in_parallel(count, {}, [&](std::size_t i, const Observer&) {
                  ++done[i];
                  return Status{};
                }).ok());
    for (const auto& times : done) EXPECT_EQ(times, 1);
  }
}

TEST(InParallel, TheObserverIsToldOfAllOfItByOneAtATime) {
  std::vector<double> fractions;  // unguarded: ThreadSanitizer sees whether two are told at once
  const Observer observer = [&](double fraction, std::string_view) {
    fractions.push_back(fraction);
    return true;
  };
  ASSERT_TRUE(in_parallel(8, observer, [](std::size_t, const Observer& seen) -> Status {
                for (const double fraction : {0.25, 0.5, 0.75})
                  EMBERLOCK_RETURN_IF_ERROR(observe(seen, fraction, "going on"));
                return {};
              }).ok());
  EXPECT_EQ(fractions.size(), 8 * 3);
  EXPECT_THAT(fractions, Each(Le(1)));
  EXPECT_TRUE(std::is_sorted(fractions.begin(), fractions.end()));
  EXPECT_GE(fractions.back(), 0.75);
}

TEST(InParallel, TheFirstFailureIsTheAnswerAndEndsTheRest) {
  std::atomic<int> begun = 0;
  const Status ended = in_parallel(1000, {}, [&](std::size_t i, const Observer& seen) -> Status {
    ++begun;
    if (i == 3) return Error{ErrorKind::io, "no room", "disk"};
    while (i > 3 && observe(seen, 0.5, "going on").ok()) {
    }
    return {};
  });
  EXPECT_EQ(ended.error().what, "no room");
  EXPECT_LT(begun, 1000);
}

TEST(InParallel, AnObserverThatWantsNoMoreEndsIt) {
  std::atomic<int> begun = 0;
  const Status ended = in_parallel(
      1000, [](double, std::string_view) { return false; },
      [&](std::size_t, const Observer& seen) {
        ++begun;
        return observe(seen, 0, "beginning");
      });
  EXPECT_EQ(ended.error().kind, ErrorKind::refused);
  EXPECT_LT(begun, 1000);
}

}  // namespace
}  // namespace emberlock
