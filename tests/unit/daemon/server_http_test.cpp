// SPDX-License-Identifier: Apache-2.0
// The console's server, asked by a client that says whatever bytes a test likes.
#include <atomic>
#include <future>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/http_server.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {

using nlohmann::json;
using test::ask;
using test::ask_raw;
using test::HttpAnswer;
using test::wait_until;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class ServerHttpThreads : public test::HttpServerTest {
 protected:
  ServerHttpThreads() {
    test::put_bytes(folder / "console/assets/main-0a1b2c3d.js", "start()");
    test::put_bytes(folder / "secret", "secret");
    std::filesystem::create_symlink(folder / "secret", folder / "console/link.txt");
  }
  void serve(HttpServerOptions options = {}) { HttpServerTest::serve(with_token(std::move(options))); }
  /// Asks for a job, and returns once it runs.
  UniqueFd begin(test::EndlessJob& job) {
    api.on_job = std::ref(job);
    UniqueFd client = call("Sessions/Export");
    EXPECT_TRUE(wait_until([&] { return job.begun(); }));
    return client;
  }
};

TEST_F(ServerHttpThreads, TheConsoleIsServedAndOnlyItsHashedNamesAreKeptForGood) {
  serve();
  const HttpAnswer page = ask(port, "GET", "/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.body, "<!doctype html>console");
  EXPECT_THAT(page.head, HasSubstr("Content-Type: text/html"));
  EXPECT_THAT(page.head, HasSubstr("script-src 'self'"));
  EXPECT_THAT(page.head, HasSubstr("X-Content-Type-Options: nosniff"));
  EXPECT_THAT(page.head, HasSubstr("Cache-Control: no-cache"));
  const HttpAnswer script = ask(port, "GET", "/assets/main-0a1b2c3d.js");
  EXPECT_EQ(script.body, "start()");
  EXPECT_THAT(script.head, HasSubstr("text/javascript"));
  EXPECT_THAT(script.head, HasSubstr("immutable"));
}

TEST_F(ServerHttpThreads, WhatABrowserHasAlreadyIsNotSentAgain) {
  serve();
  const HttpAnswer page = ask(port, "GET", "/");
  const std::size_t at = page.head.find("ETag: ");
  ASSERT_NE(at, std::string::npos);
  const std::string tag = page.head.substr(at + 6, page.head.find("\r\n", at) - at - 6);
  const HttpAnswer again = ask(port, "GET", "/", "", test::kLetIn + "If-None-Match: " + tag + "\r\n");
  EXPECT_EQ(again.status, 304);
  EXPECT_THAT(again.body, IsEmpty());
  const HttpAnswer head = ask(port, "HEAD", "/");
  EXPECT_EQ(head.status, 200);
  EXPECT_THAT(head.body, IsEmpty());
  EXPECT_THAT(head.head, HasSubstr("Content-Length: 22"));
}

TEST_F(ServerHttpThreads, NoPathLeadsOutOfTheConsole) {
  serve();
  for (const char* path : {"/../secret", "/assets/../../secret", "/%2e%2e/secret", "/..%2fsecret", "//secret",
                           "/link.txt", "/./secret", "/console/../secret", "secret", "../secret", "*",
                           "http://localhost/../secret", "/index.html%00.js", "/assets"}) {
    const HttpAnswer answer = ask(port, "GET", path);
    EXPECT_THAT(answer.status, AnyOf(400, 404)) << path;
    EXPECT_THAT(answer.body, Not(HasSubstr("\"secret\""))) << path;
  }
}

TEST_F(ServerHttpThreads, CallsAreAskedOfTheApiInJson) {
  api.on_record = [](const v1::RecordRequest& request) {
    v1::RecordingStatus status;
    status.set_session(request.name());
    status.set_bytes_per_s(5);
    return status;
  };
  serve();
  const HttpAnswer answer =
      ask(port, "POST", "/api/v1/Capture/Record", R"({"name": "flame 1", "unlocked": true})");
  EXPECT_EQ(answer.status, 200);
  EXPECT_EQ(json::parse(answer.body), json({{"session", "flame 1"}, {"bytes_per_s", 5}}));
  EXPECT_EQ(ask(port, "POST", "/api/v1/Sync/Stop").body, "{}");
  EXPECT_THAT(api.calls(), ElementsAre("record name: \"flame 1\" unlocked: true", "stop_sync"));
}

TEST_F(ServerHttpThreads, AnErrorHasItsCodeAndTheWholeMessage) {
  api.on_stop_sync = [] { return Error{ErrorKind::refused, "nothing is aligned", "sync", "align first"}; };
  serve();
  const HttpAnswer answer = ask(port, "POST", "/api/v1/Sync/Stop");
  EXPECT_EQ(answer.status, 409);
  EXPECT_EQ(json::parse(answer.body),
            json({{"code", "FAILED_PRECONDITION"}, {"message", "sync: nothing is aligned. Align first"}}));
}

TEST_F(ServerHttpThreads, WhatIsNoRequestOfOursIsRefusedAndNeverReachesTheApi) {
  serve();
  const struct {
    const char* method;
    const char* target;
    std::string body;
    int status;
  } cases[] = {
      {"POST", "/api/v1/Sync/Align", "{", 400},
      {"POST", "/api/v1/Sync/Align", "[]", 400},
      {"POST", "/api/v1/Sync/Align", R"({"tolerence": "100rows"})", 400},
      {"POST", "/api/v1/Sync/Align", R"({"anyway": "perhaps"})", 400},
      {"POST", "/api/v1/Sync/Align", std::string(100'000, '['), 400},
      {"POST", "/api/v1/Sync/Nothing", "", 404},
      {"POST", "/api/v1/", "", 404},
      {"GET", "/api/v1/Sync/Align", "", 405},
      {"DELETE", "/", "", 405},
      {"GET", "/api/v1/watch", "", 426},
      {"GET", "/nothing", "", 404},
  };
  for (const auto& c : cases)
    EXPECT_EQ(ask(port, c.method, c.target, c.body).status, c.status) << c.target << c.body;
  EXPECT_THAT(api.calls(), IsEmpty());
}

TEST_F(ServerHttpThreads, OversizedAndMalformedRequestsAreRefused) {
  serve();
  EXPECT_EQ(ask(port, "GET", "/" + std::string(20'000, 'a')).status, 431);
  EXPECT_EQ(ask(port, "GET", "/", "", test::kLetIn + "X: " + std::string(20'000, 'a') + "\r\n").status, 431);
  EXPECT_EQ(ask(port, "POST", "/api/v1/Sync/Align", std::string(2'000'000, ' ')).status, 413);
  EXPECT_EQ(ask_raw(port, "this is no HTTP\r\n\r\n").status, 400);
  EXPECT_EQ(ask_raw(port, std::string("\x16\x03\x01\x02\x00\x01", 6) + std::string(500, '\0')).status, 400);
  EXPECT_THAT(api.calls(), IsEmpty());
}

TEST_F(ServerHttpThreads, AClientThatDawdlesIsCutOff) {
  serve({.patience = milliseconds(100)});
  const UniqueFd idle = test::connect_to(port);
  const UniqueFd in_head = test::connect_to(port);
  test::send_all(in_head, "GET / HTTP/1.1\r\nHost:");
  const UniqueFd in_body = test::connect_to(port);
  test::send_all(in_body,
                 "POST /api/v1/Sync/Stop HTTP/1.1\r\n" + test::kLetIn + "Content-Length: 10\r\n\r\n{");
  // Each ends, without an answer.
  for (const UniqueFd* socket : {&idle, &in_head, &in_body})
    EXPECT_THAT(test::read_to_end(*socket), IsEmpty());
  // On a busy machine any client may seem to dawdle.
  EXPECT_TRUE(wait_until([&] { return ask(port, "GET", "/").status == 200; }));
}

TEST_F(ServerHttpThreads, BeyondTheQueueCallsAreRefused) {
  std::promise<void> go;
  const std::shared_future<void> gone = go.get_future().share();
  std::atomic<int> running = 0;
  api.on_stop_sync = [&] {
    ++running;
    gone.wait();
    return Status();
  };
  serve({.workers = 1, .waiting = 0});
  auto first = std::async(std::launch::async, [&] { return ask(port, "POST", "/api/v1/Sync/Stop").status; });
  ASSERT_TRUE(wait_until([&] { return running == 1; }));
  EXPECT_EQ(ask(port, "POST", "/api/v1/Sync/Stop").status, 429);
  EXPECT_EQ(ask(port, "GET", "/").status, 200);
  go.set_value();
  EXPECT_EQ(first.get(), 200);
}

TEST_F(ServerHttpThreads, AnotherSitesPageAndAForeignNameAreTurnedAway) {
  serve();
  const std::string kShown = std::string("Authorization: Bearer ") + test::kHttpToken + "\r\n";
  const auto status_for = [&](const std::string& headers) {
    return ask(port, "POST", "/api/v1/Sync/Stop", "", headers + kShown).status;
  };
  EXPECT_EQ(status_for("Host: localhost:7140\r\nOrigin: http://localhost:7140\r\n"), 200);
  EXPECT_EQ(status_for("Host: 127.0.0.1\r\n"), 200);
  EXPECT_EQ(status_for("Host: [::1]:7140\r\n"), 200);
  EXPECT_EQ(status_for("Host: localhost:7140\r\nOrigin: http://evil.example\r\n"), 403);
  EXPECT_EQ(status_for("Host: localhost:7140\r\nOrigin: http://localhost:8000\r\n"), 403);
  EXPECT_EQ(status_for("Host: localhost\r\nOrigin: null\r\n"), 403);
  EXPECT_EQ(status_for("Host: evil.example\r\n"), 421);
  EXPECT_EQ(status_for("Host: localhost.evil.example:80\r\n"), 421);
  EXPECT_EQ(status_for("Host: 127.0.0.1.evil.example\r\n"), 421);
  EXPECT_EQ(status_for(""), 421);
  EXPECT_EQ(api.calls().size(), 3U);
}

TEST_F(ServerHttpThreads, AJobTellsALineForEachProgressAndItsLast) {
  api.on_job = test::job_that_tells(100);
  serve();
  const HttpAnswer answer = ask(port, "POST", "/api/v1/Sessions/Verify", R"({"session": "s"})");
  EXPECT_EQ(answer.status, 200);
  EXPECT_THAT(answer.head, HasSubstr("application/x-ndjson"));
  EXPECT_THAT(answer.body, HasSubstr("\"state\":\"DONE\""));
  EXPECT_THAT(answer.body, HasSubstr("\"outcome\":{}}\n\r\n0\r\n\r\n"));
}

TEST_F(ServerHttpThreads, AJobThatCannotBeginIsAnError) {
  api.on_begin = Error{ErrorKind::bad_input, "no such session", "x"};
  serve();
  EXPECT_EQ(ask(port, "POST", "/api/v1/Sessions/Repair", R"({"session": "x"})").status, 400);
  EXPECT_EQ(ask(port, "POST", "/api/v1/Sessions/Repair", "x").status, 400);
}

TEST_F(ServerHttpThreads, AJobThatFailsOnItsWayEndsItsStreamWithTheError) {
  std::atomic<bool> seen = false;
  api.on_job = [&](const Observer& observer) -> JobResult {
    observer(0, "writes");
    wait_until([&] { return seen.load(); });
    return Error{ErrorKind::io, "no space left on device", "exports/flame", "Free space"};
  };
  serve();
  for (const char* job : {"Verify", "Repair", "Export"}) {
    seen = false;
    const UniqueFd client = call(std::string("Sessions/") + job);
    std::string answer = read_until(client, "writes");
    seen = true;
    answer += test::read_to_end(client);
    EXPECT_THAT(answer, HasSubstr("HTTP/1.1 200"));
    EXPECT_THAT(answer, HasSubstr(R"({"code":"INTERNAL","message":"exports/flame: no space left on device. )"
                                  "Free space\"}\n\r\n0\r\n\r\n"))
        << job;
  }
}

TEST_F(ServerHttpThreads, AStepOfAStylizationComesWithItsPictureInBase64) {
  api.on_edit_reconstruction = test::step_with_picture;
  serve();
  const std::string path = "/api/v1/Reconstruct/Edit";
  const auto taken = ask(port, "POST", path, R"({"operation": "{}", "picture": "dm94ZWxz"})");
  EXPECT_EQ(json::parse(taken.body)["steps"], 3);
  const auto refused = ask(port, "POST", path, R"({"operation": "{}"})");
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(json::parse(refused.body)["message"], "step: picture: is missing");
  EXPECT_EQ(ask(port, "POST", "/api/v1/Reconstruct/Finish", "{}").status, 200);
}

TEST_F(ServerHttpThreads, AFrameThatIsNotHeldIsNotFound) {
  api.on_reconstructed_frame = test::twelfth_frame;
  serve();
  const auto found =
      ask(port, "POST", "/api/v1/Reconstruct/Frame", R"({"reconstruction": "r", "frame": 12})");
  EXPECT_EQ(json::parse(found.body)["volume"]["voxels"], "dm94ZWxz");
  const auto absent = ask(port, "POST", "/api/v1/Reconstruct/Frame", R"({"frame": "13"})");
  EXPECT_EQ(absent.status, 404);
  EXPECT_EQ(json::parse(absent.body)["code"], "NOT_FOUND");
}

TEST_F(ServerHttpThreads, AFlameOnAMarkerIsAskedForByNames) {
  api.on_list_results = [] {
    v1::ListResultsResponse listed;
    listed.add_results()->set_session("candle");
    return Result<v1::ListResultsResponse>(listed);
  };
  api.on_start_ar = [](const v1::ArRequest& request) -> Result<v1::ArStatus> {
    if (request.session() != "candle")
      return Error{ErrorKind::bad_input, "there is no such result", request.session()};
    v1::ArStatus status;
    status.set_state(v1::ArStatus::SHOWN);
    return status;
  };
  api.on_stop_ar = [] {
    return Result<v1::ArStatus>(Error{ErrorKind::refused, "none is shown", "the flame"});
  };
  serve();
  EXPECT_EQ(ask(port, "POST", "/api/v1/Ar/Results", "{}").body, R"({"results":[{"session":"candle"}]})");
  EXPECT_EQ(ask(port, "POST", "/api/v1/Ar/Start", R"({"session": "candle"})").body, R"({"state":"SHOWN"})");
  EXPECT_EQ(ask(port, "POST", "/api/v1/Ar/Start", R"({"session": "../candle"})").status, 400);
  EXPECT_EQ(ask(port, "POST", "/api/v1/Ar/Start", R"({"path": "/etc"})").status, 400)
      << "there is no such field";
  EXPECT_EQ(ask(port, "POST", "/api/v1/Ar/Stop", "{}").status, 409);
}

TEST_F(ServerHttpThreads, AJobIsCancelledByItsNumberAndSaysSo) {
  test::EndlessJob endless;
  serve();
  const UniqueFd client = begin(endless);
  EXPECT_EQ(ask(port, "POST", "/api/v1/Jobs/Cancel", R"({"id": 77})").status, 409);
  EXPECT_EQ(ask(port, "POST", "/api/v1/Jobs/Cancel", R"({"id": 1})").status, 200);
  EXPECT_THAT(test::read_to_end(client), HasSubstr("ended early, as asked"));
  EXPECT_TRUE(endless.ended());
}

TEST_F(ServerHttpThreads, AJobEndsWhenItsClientGoesInMidStream) {
  test::EndlessJob endless;
  serve();
  { const UniqueFd client = begin(endless); }
  EXPECT_TRUE(wait_until([&] { return endless.ended(); }));
}

TEST_F(ServerHttpThreads, TheServerGoesWhileJobsRun) {
  test::EndlessJob endless;
  serve();
  const UniqueFd client = begin(endless);
  server.reset();
  EXPECT_TRUE(wait_until([&] { return endless.ended(); }));
}

TEST_F(ServerHttpThreads, HealthAndMetricsFollowTheEngine) {
  serve();
  EXPECT_EQ(ask(port, "GET", "/healthz").status, 503);
  show(v1::LOCKED);
  EXPECT_EQ(ask(port, "GET", "/healthz").status, 200);
  EXPECT_EQ(ask(port, "POST", "/healthz", std::string(1 << 20, 'x')).status, 413)
      << "strangers fill no memory";
  const HttpAnswer metrics = ask(port, "GET", "/metrics");
  EXPECT_THAT(metrics.head, HasSubstr("text/plain; version=0.0.4"));
  EXPECT_THAT(metrics.body, HasSubstr("emberlock_phase{state=\"locked\"} 1\n"));
}

TEST_F(ServerHttpThreads, ATakenPortIsAnError) {
  serve();
  const auto second = HttpServer::start(api, {.listen = "127.0.0.1:" + std::to_string(port)});
  ASSERT_FALSE(second.ok());
  EXPECT_THAT(second.error().message(), HasSubstr("Address already in use"));
}

}  // namespace
}  // namespace emberlock::daemon
