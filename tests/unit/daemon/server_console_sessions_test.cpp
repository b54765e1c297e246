// SPDX-License-Identifier: Apache-2.0
// Links and the sessions that they open.
#include <set>

#include <gmock/gmock.h>

#include "daemon/server/console_sessions.h"

namespace emberlock::daemon {
namespace {

using testing::HasSubstr;
using testing::MatchesRegex;

const std::string kHere = "http://127.0.0.1:7140";

class ServerConsoleSessions : public testing::Test {
 protected:
  ServerConsoleSessions() { sessions.serve_at(kHere); }
  std::string link() { return sessions.make_link(now).value().substr((kHere + "/open?link=").size()); }
  void wait(Seconds time) { now = now + time; }
  ConsoleSessions sessions;
  TimePoint now{1};
};

TEST_F(ServerConsoleSessions, WithoutAConsoleThereIsNoLink) {
  ConsoleSessions nowhere;
  const auto link = nowhere.make_link(now);
  ASSERT_FALSE(link.ok());
  EXPECT_EQ(link.error().kind, ErrorKind::refused);
  EXPECT_THAT(link.error().message(), HasSubstr("http_listen"));
}

TEST_F(ServerConsoleSessions, ALinkHas256BitsAndOpensOneSession) {
  EXPECT_THAT(sessions.make_link(now).value(),
              MatchesRegex("http://127\\.0\\.0\\.1:7140/open\\?link=[0-9a-f]{64}"));
  const std::string secret = link();
  const auto session = sessions.follow(secret, now);
  ASSERT_TRUE(session);
  EXPECT_NE(*session, secret);
  EXPECT_FALSE(sessions.follow(secret, now)) << "once";
  EXPECT_TRUE(sessions.find(*session, now));
  EXPECT_FALSE(sessions.find(secret, now)) << "a link is no session";
  EXPECT_FALSE(sessions.follow(*session, now)) << "nor a session a link";
  std::string other = *session;
  other[5] = other[5] == '0' ? '1' : '0';
  for (const std::string& wrong : {std::string(), other, session->substr(1), *session + "0"}) {
    EXPECT_FALSE(sessions.find(wrong, now)) << wrong;
    EXPECT_FALSE(sessions.follow(wrong, now)) << wrong;
  }
}

TEST_F(ServerConsoleSessions, ALinkIsVoidAfterTwoMinutes) {
  const std::string in_time = link(), late = link();
  wait(ConsoleSessions::kLinkLife - Seconds(1));
  EXPECT_TRUE(sessions.follow(in_time, now));
  wait(Seconds(2));
  EXPECT_FALSE(sessions.follow(late, now));
}

TEST_F(ServerConsoleSessions, OnlyTheNewestLinksCount) {
  const std::string first = link();
  std::set<std::string> others;
  for (std::size_t i = 0; i < ConsoleSessions::kMostLinks; ++i) others.insert(link());
  EXPECT_EQ(others.size(), ConsoleSessions::kMostLinks) << "no two alike";
  EXPECT_FALSE(sessions.follow(first, now));
  for (const std::string& one : others) EXPECT_TRUE(sessions.follow(one, now));
}

TEST_F(ServerConsoleSessions, ASessionThatIsShownLastsAndOneThatIsNotEnds) {
  const std::string used = *sessions.open(now), forgotten = *sessions.open(now);
  for (int week = 0; week < 8; ++week) {
    EXPECT_TRUE(sessions.find(used, now));
    wait(Seconds(7 * 86'400.0));
  }
  EXPECT_TRUE(sessions.find(used, now));
  EXPECT_FALSE(sessions.find(forgotten, now));
}

TEST_F(ServerConsoleSessions, BeyondTheMostTheSessionShownLongestAgoEnds) {
  const std::string kept = *sessions.open(now);
  const std::string lost = *sessions.open(now);
  for (std::size_t i = 0; i < ConsoleSessions::kMostSessions - 1; ++i) {
    EXPECT_TRUE(sessions.find(kept, now));
    ASSERT_TRUE(sessions.open(now));
  }
  EXPECT_TRUE(sessions.find(kept, now));
  EXPECT_FALSE(sessions.find(lost, now));
}

}  // namespace
}  // namespace emberlock::daemon
