// SPDX-License-Identifier: Apache-2.0
// Who gets in over HTTP on this machine: browsers by a link, programs by the token, nobody else; and nobody
// shuts the operator out.
#include <chrono>
#include <memory>
#include <vector>

#include <gmock/gmock.h>

#include "base/clock.h"
#include "tests/support/http_server.h"
#include "tests/support/wait.h"
#include "tests/support/watch_client.h"

namespace emberlock::daemon {
namespace {

using test::ask;
using test::HttpAnswer;
using test::wait_until;
using test::WatchClient;
using testing::AllOf;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

const std::string kBare = "Host: 127.0.0.1:7140\r\n";

class ServerDoor : public test::HttpServerTest {
 protected:
  ServerDoor() { test::put_bytes(folder / "console/assets/main.js", "start()"); }
  void serve(HttpServerOptions options = {}) {
    options.sessions = sessions;
    HttpServerTest::serve(std::move(options));
  }
  /// "/open?link=..."
  std::string link() {
    const std::string url = sessions->make_link(SteadyClock().now()).value();
    EXPECT_TRUE(url.starts_with(server->url() + "/open?link="));
    return url.substr(server->url().size());
  }
  /// The headers of a browser that followed a link.
  std::string browser() {
    const std::string cookie = test::cookie_of(ask(port, "GET", link(), "", kBare));
    EXPECT_FALSE(cookie.empty());
    return kBare + "Cookie: " + cookie + "\r\n";
  }
  [[nodiscard]] int status_of(const std::string& headers) const {
    return ask(port, "POST", "/api/v1/Sync/Stop", "", headers).status;
  }
  [[nodiscard]] double count(const std::string& reason) {
    const std::string sample = "emberlock_refused_total{by=\"http\",reason=\"" + reason + "\"} ";
    const std::string metrics = ask(port, "GET", "/metrics", "", browser()).body;
    const std::size_t at = metrics.find(sample);
    return at == std::string::npos ? -1 : std::stod(metrics.substr(at + sample.size()));
  }

  std::shared_ptr<ConsoleSessions> sessions = std::make_shared<ConsoleSessions>();
};

TEST_F(ServerDoor, WhoShowsNothingIsToldWhatToDoAndGetsNothingElse) {
  for (const bool token : {false, true}) {
    serve(token ? with_token() : HttpServerOptions());
    EXPECT_EQ(status_of(kBare), 401);
    EXPECT_EQ(ask(port, "GET", "/metrics", "", kBare).status, 401);
    EXPECT_EQ(ask(port, "GET", "/assets/main.js", "", kBare).status, 401);
    EXPECT_THAT(WatchClient(port, kBare).answer(), HasSubstr("401"));
    const HttpAnswer page = ask(port, "GET", "/", "", kBare);
    EXPECT_EQ(page.status, 401);
    EXPECT_THAT(page.head,
                AllOf(HasSubstr("text/html"), HasSubstr("WWW-Authenticate"), HasSubstr("no-store")));
    EXPECT_THAT(page.body, AllOf(HasSubstr("emberlock console"), Not(HasSubstr("<script"))));
    EXPECT_EQ(page.body.find("<form") != std::string::npos, token)
        << "where there is a token it can be given";
    EXPECT_NE(ask(port, "GET", "/healthz", "", kBare).status, 401);
  }
  EXPECT_THAT(api.calls(), IsEmpty());
}

TEST_F(ServerDoor, ALinkOpensTheConsoleOnceAndItsSecretLeavesTheAddress) {
  serve();
  const std::string target = link();
  EXPECT_EQ(ask(port, "HEAD", target, "", kBare).status, 401) << "to look isn't to follow";
  const HttpAnswer opened = ask(port, "GET", target, "", kBare);
  EXPECT_EQ(opened.status, 303);
  EXPECT_THAT(opened.head,
              AllOf(HasSubstr("Location: /\r\n"), HasSubstr("HttpOnly"), HasSubstr("SameSite=Strict"),
                    Not(HasSubstr("Secure")), HasSubstr("Referrer-Policy: no-referrer")));
  const std::string known = kBare + "Cookie: " + test::cookie_of(opened) + "\r\n";
  const HttpAnswer console = ask(port, "GET", "/", "", known);
  EXPECT_EQ(console.body, "<!doctype html>console");
  EXPECT_THAT(console.head, HasSubstr("Max-Age=2592000")) << "opened again, it lasts 30 days more";
  EXPECT_EQ(test::cookie_of(console), test::cookie_of(opened));
  EXPECT_EQ(status_of(known), 200);
  EXPECT_TRUE(WatchClient(port, known).open());
  const HttpAnswer again = ask(port, "GET", target, "", kBare);
  EXPECT_EQ(again.status, 401);
  EXPECT_THAT(again.body, HasSubstr("opened already"));
  EXPECT_THAT(test::cookie_of(again), IsEmpty());
  EXPECT_EQ(ask(port, "GET", target, "", known).status, 303) << "the browser's way back leads to the console";
}

TEST_F(ServerDoor, ACookieOfAnEarlierDaemonOpensNothingAndIsForgotten) {
  serve();
  const std::string known = browser();
  sessions = std::make_shared<ConsoleSessions>();
  serve();
  const HttpAnswer answer = ask(port, "GET", "/", "", known);
  EXPECT_EQ(answer.status, 401);
  EXPECT_THAT(answer.body, HasSubstr("has started anew"));
  EXPECT_THAT(answer.head, HasSubstr("Max-Age=0"));
  // Programs of a page that is open, and whoever waits for guessing: the browser may have a new one by now.
  EXPECT_THAT(ask(port, "POST", "/api/v1/Strobe/State", "{}", known).head, Not(HasSubstr("Max-Age")));
  for (int guess = 0; guess < 3; ++guess) EXPECT_EQ(ask(port, "GET", "/", "", known).status, 401) << guess;
  EXPECT_THAT(ask(port, "GET", "/", "", known).head, Not(HasSubstr("Max-Age")));
}

TEST_F(ServerDoor, AnotherSitesPageGetsNowhereWithTheCookie) {
  serve();
  const std::string known = browser();
  for (const char* origin :
       {"http://evil.example", "http://127.0.0.1:8000", "https://127.0.0.1:7140", "null"}) {
    const std::string headers = known + "Origin: " + origin + "\r\n";
    EXPECT_EQ(status_of(headers), 403) << origin;
    EXPECT_THAT(WatchClient(port, headers).answer(), HasSubstr("403")) << origin;
  }
  EXPECT_EQ(status_of(known + "Origin: http://127.0.0.1:7140\r\n"), 200);
  std::string renamed = known;
  renamed.replace(renamed.find("127.0.0.1"), 9, "evil.exam");
  EXPECT_EQ(status_of(renamed), 421);
  // Nor can it spend a link.
  const std::string target = link();
  EXPECT_EQ(ask(port, "GET", target, "", "Host: evil.example:7140\r\n").status, 421);
  EXPECT_EQ(ask(port, "GET", target, "", kBare).status, 303);
}

TEST_F(ServerDoor, TheTokenLetsInWhereThereIsOneByHeaderAddressOrForm) {
  serve(with_token());
  EXPECT_EQ(status_of(kBare + "Authorization: Bearer " + test::kHttpToken + "\r\n"), 200);
  EXPECT_EQ(ask(port, "GET", std::string("/?token=") + test::kHttpToken, "", kBare).status, 303);
  const HttpAnswer by_form = ask(port, "POST", "/open", std::string("token=") + test::kHttpToken,
                                 kBare + "Origin: http://127.0.0.1:7140\r\n");
  EXPECT_EQ(by_form.status, 303);
  EXPECT_EQ(status_of(kBare + "Cookie: " + test::cookie_of(by_form) + "\r\n"), 200);
  EXPECT_EQ(ask(port, "POST", "/open", std::string("token=") + test::kHttpToken,
                kBare + "Origin: http://evil.example\r\n")
                .status,
            403);
  EXPECT_EQ(ask(port, "POST", "/open", "token=wrong", kBare).status, 401);
  EXPECT_EQ(ask(port, "POST", "/open", "", kBare).status, 401);
  EXPECT_EQ(ask(port, "POST", "/open", std::string(5000, 'a'), kBare).status, 413);
  EXPECT_EQ(ask(port, "GET", link(), "", kBare).status, 303) << "links open it all the same";
}

TEST_F(ServerDoor, WhereThereIsNoTokenNoneIsRight) {
  serve();
  EXPECT_EQ(status_of(test::kLetIn), 401);
  EXPECT_EQ(ask(port, "GET", std::string("/?token=") + test::kHttpToken, "", kBare).status, 401);
  EXPECT_EQ(ask(port, "POST", "/open", std::string("token=") + test::kHttpToken, kBare).status, 401);
}

// Guesses are counted, and who goes on guessing waits; who shows what is right is answered all the same, from
// the same machine and while the guesses wait.
TEST_F(ServerDoor, GuessesAreCountedAndSlowedAndHoldNobodyUp) {
  serve(with_token());
  EXPECT_EQ(ask(port, "GET", "/open?link=0123", "", kBare).status, 401);
  EXPECT_EQ(status_of(kBare + "Cookie: emberlock_session_7140=0123\r\n"), 401);
  EXPECT_EQ(status_of(kBare), 401);
  const std::string wrong = kBare + "Authorization: Bearer 0123456789abcdeX\r\n";
  for (int i = 0; i < AuthFailures::kFree + 1; ++i) EXPECT_EQ(status_of(wrong), 401);
  const auto begun = std::chrono::steady_clock::now();
  std::vector<UniqueFd> guesses;
  for (int i = 0; i < 6; ++i) {
    guesses.push_back(test::connect_to(port));
    test::send_all(guesses.back(), "GET /metrics HTTP/1.1\r\n" + wrong + "\r\n");
  }
  EXPECT_EQ(status_of(browser()), 200);
  EXPECT_EQ(status_of(test::kLetIn), 200);
  for (const UniqueFd& one : guesses) EXPECT_THAT(test::read_to_end(one), HasSubstr("401"));
  EXPECT_GE(std::chrono::steady_clock::now() - begun, std::chrono::seconds(2));
  EXPECT_EQ(count("wrong_token"), AuthFailures::kFree + 7);
  EXPECT_EQ(count("wrong_link"), 1);
  EXPECT_EQ(count("unknown_session"), 1);
  EXPECT_EQ(count("nothing_shown"), 1);
}

// As many as there are places, and more: silent ones, and ones that stop in the head.
TEST_F(ServerDoor, HalfOpenRequestsMakeRoomForWhoeverComes) {
  serve();
  const std::string known = browser();
  std::vector<UniqueFd> half;
  for (int i = 0; i < 300; ++i) {
    half.push_back(test::connect_to(port));
    if (i % 2 == 0) test::send_all(half.back(), "GET / HTTP/1.1\r\nHost: 127");
    if (i % 50 == 0) {
      EXPECT_EQ(status_of(known), 200) << i;
    }
  }
  EXPECT_EQ(status_of(known), 200);
  EXPECT_TRUE(WatchClient(port, known).open());
  EXPECT_THAT(test::read_to_end(half.front()), IsEmpty()) << "the oldest made room";
}

// What was let in stays when strangers come.
TEST_F(ServerDoor, StrangersDisplaceNobodyWhoWasLetIn) {
  serve({.connections = 8});
  const std::string known = browser();
  const UniqueFd kept = test::connect_to(port);
  const std::string request = "POST /api/v1/Sync/Stop HTTP/1.1\r\n" + known + "Content-Length: 0\r\n\r\n";
  const auto answered = [&] {
    test::send_all(kept, request);
    std::string answer;
    for (char byte = 0; !answer.ends_with("\r\n\r\n{}") && ::recv(kept.get(), &byte, 1, 0) == 1;)
      answer += byte;
    return answer.find(" 200 ") != std::string::npos;
  };
  ASSERT_TRUE(answered());
  std::vector<UniqueFd> strangers;
  for (int i = 0; i < 40; ++i) strangers.push_back(test::connect_to(port));
  EXPECT_THAT(test::read_to_end(strangers.front()), IsEmpty());
  EXPECT_TRUE(answered());
}

TEST_F(ServerDoor, ACallThatRunsIsNotCutOffByTheNext) {
  serve({.connections = 1});
  const std::string known = browser();
  test::EndlessJob job;
  api.on_job = std::ref(job);
  const UniqueFd client = call("Sessions/Export", known);
  ASSERT_TRUE(wait_until([&] { return job.begun(); }));
  EXPECT_EQ(ask(port, "GET", "/healthz", "", kBare).status, 0) << "there is no place";
  EXPECT_FALSE(job.ended());
  server.reset();
  EXPECT_TRUE(wait_until([&] { return job.ended(); }));
}

// 64 of another session's that say nothing, and more: the operator's console opens, and stays.
TEST_F(ServerDoor, IdleWebSocketsOfOneSessionMakeRoomForAnothers) {
  serve();
  const std::string idle = browser(), own = browser();
  std::vector<std::unique_ptr<WatchClient>> crowd;
  for (int i = 0; i < 64; ++i) crowd.push_back(std::make_unique<WatchClient>(port, idle));
  WatchClient console(port, own);
  ASSERT_TRUE(console.open());
  for (int i = 0; i < 64; ++i) {
    crowd.push_back(std::make_unique<WatchClient>(port, idle));
    EXPECT_TRUE(crowd.back()->open());
  }
  EXPECT_EQ(server->viewers(), 64U);
  EXPECT_TRUE(console.wish("{\"watch\": null}")) << "it still answers";
}

}  // namespace
}  // namespace emberlock::daemon
