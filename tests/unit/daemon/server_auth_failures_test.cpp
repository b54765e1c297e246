// SPDX-License-Identifier: Apache-2.0
// Who guesses is counted, slowed and logged; nobody else is slowed, and the log stays readable.
#include <gmock/gmock.h>

#include "daemon/server/auth_failures.h"
#include "daemon/server/repeat_filter.h"

namespace emberlock::daemon {
namespace {

using testing::HasSubstr;

class ServerAuthFailures : public testing::Test {
 protected:
  AuthFailures::Outcome guess(const std::string& source, Refusal refusal = Refusal::wrong_token) {
    return failures.note("http", source, refusal, now);
  }
  AuthFailures failures;
  TimePoint now{1'000'000'000};
};

TEST_F(ServerAuthFailures, ASourceThatGuessesIsSlowedMoreAndMoreUpToABoundAndItAlone) {
  double before = 0;
  for (int i = 1; i <= 100; ++i) {
    const double delay = guess("user 1").delay.value();
    EXPECT_EQ(delay > 0, i > AuthFailures::kFree) << i;
    EXPECT_GE(delay, before) << i;
    EXPECT_LE(delay, AuthFailures::kLongestDelay.value()) << i;
    before = delay;
  }
  EXPECT_EQ(before, AuthFailures::kLongestDelay.value());
  EXPECT_EQ(guess("user 2").delay, Seconds(0));
  now = now + AuthFailures::kForget + Seconds(1);
  EXPECT_EQ(guess("user 1").delay, Seconds(0)) << "a minute later it begins anew";
}

TEST_F(ServerAuthFailures, WhoShowsNothingOrAsksByAForeignNameGuessesNothing) {
  for (int i = 0; i < 20; ++i) {
    for (const Refusal refusal : {Refusal::nothing_shown, Refusal::foreign_host, Refusal::foreign_origin})
      EXPECT_EQ(guess("user 1", refusal).delay, Seconds(0));
  }
  EXPECT_EQ(guess("user 1").delay, Seconds(0));
}

TEST_F(ServerAuthFailures, EachRefusalIsCountedByItsReasonAndWay) {
  for (int i = 0; i < 5; ++i) guess("user 1");
  guess("user 2", Refusal::nothing_shown);
  failures.note("grpc", "the network", Refusal::wrong_token, now);
  const auto counts = failures.counts();
  EXPECT_EQ(counts.at("http")[static_cast<std::size_t>(Refusal::wrong_token)], 5U);
  EXPECT_EQ(counts.at("http")[static_cast<std::size_t>(Refusal::nothing_shown)], 1U);
  EXPECT_EQ(counts.at("grpc")[static_cast<std::size_t>(Refusal::wrong_token)], 1U);
  EXPECT_EQ(name_of(Refusal::wrong_token), "wrong_token");
  EXPECT_EQ(name_of(Refusal::foreign_origin), "foreign_origin");
}

TEST_F(ServerAuthFailures, TheLogSaysWhoAndWhyOnceAMinuteAndThenHowOften) {
  const auto first = guess("user 1").line;
  ASSERT_TRUE(first);
  EXPECT_THAT(*first, testing::AllOf(HasSubstr("user 1"), HasSubstr("wrong token"), HasSubstr("http")));
  for (int i = 0; i < 41; ++i) EXPECT_FALSE(guess("user 1").line);
  now = now + AuthFailures::kLogApart;
  const auto later = guess("user 1").line;
  ASSERT_TRUE(later);
  EXPECT_THAT(*later, HasSubstr("41 times"));
}

// A hundred thousand guesses from five thousand addresses, within ten minutes.
TEST_F(ServerAuthFailures, HoweverManyGuessTheLogAndTheMemoryAreBounded) {
  constexpr int kGuesses = 100'000;
  int lines = 0;
  for (int i = 0; i < kGuesses; ++i) {
    lines += guess("192.0." + std::to_string(i % 5000)).line ? 1 : 0;
    now = now + Seconds(600.0 / kGuesses);
  }
  EXPECT_GE(lines, 10 * AuthFailures::kMostLines / 2) << "but something is said each minute";
  EXPECT_LE(lines, 11 * AuthFailures::kMostLines);
  EXPECT_EQ(failures.counts().at("http")[static_cast<std::size_t>(Refusal::wrong_token)], 100'000U);
}

/// Two messages a second for an hour, of two places in gRPC.
TEST(RepeatFilter, PassesOneOfAKindAMinuteAndCountsTheRest) {
  RepeatFilter filter;
  std::uint64_t passed = 0, counted = 0;
  constexpr int kHalfSeconds = 7200;
  for (int i = 0; i <= kHalfSeconds; ++i)
    for (const int line : {1495, 7}) {
      const auto before = filter.pass("ssl_transport_security.cc", line, {i * std::int64_t{500'000'000}});
      if (!before) continue;
      ++passed;
      counted += *before;
    }
  EXPECT_EQ(passed, 2 * 61U);
  EXPECT_EQ(passed + counted, 2 * (kHalfSeconds + 1U));
}

}  // namespace
}  // namespace emberlock::daemon
