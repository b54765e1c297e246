// SPDX-License-Identifier: Apache-2.0
// The console's server beyond this machine: over TLS, to who has the token.
#include <optional>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "tests/support/certificate.h"
#include "tests/support/http_server.h"
#include "tests/support/tls_tunnel.h"
#include "tests/support/wait.h"
#include "tests/support/watch_client.h"

namespace emberlock::daemon {
namespace {

using nlohmann::json;
using test::ask;
using test::HttpAnswer;
using test::wait_until;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::MatchesRegex;
using testing::StartsWith;

const std::string kToken = test::kHttpToken;
const std::string kShown = "Host: lab:7140\r\nAuthorization: Bearer " + kToken + "\r\n";

class ServerHttpTlsThreads : public test::HttpServerTest {
 protected:
  HttpServerOptions options() const {
    HttpServerOptions options = with_token({.listen = "0.0.0.0:0"});
    options.tls = rig::ServerTls{servers.issue("localhost")};
    return options;
  }
  void serve(HttpServerOptions wanted) {
    show(v1::LOCKED);
    HttpServerTest::serve(std::move(wanted));
    tunnel.emplace(server->port(), servers.pem());
    port = tunnel->port();
  }

  test::CertificateAuthority servers{"who signs servers"};
  std::optional<test::TlsTunnel> tunnel;
};

TEST_F(ServerHttpTlsThreads, BeyondThisMachineItStartsOnlyWithTokenAndCertificate) {
  HttpServerOptions lacking = options();
  lacking.token.reset();
  const auto without_token = HttpServer::start(api, lacking);
  ASSERT_FALSE(without_token.ok());
  EXPECT_THAT(without_token.error().message(), HasSubstr("--make-token"));
  lacking = options();
  lacking.tls.reset();
  const auto without_tls = HttpServer::start(api, lacking);
  ASSERT_FALSE(without_tls.ok());
  EXPECT_THAT(without_tls.error().message(), HasSubstr("Name a certificate and its key"));
  for (const char* nowhere :
       {"", "7140", "localhost", "lab:7140", "127.0.0.1:", "127.0.0.1:99999", "127.0.0.1:71x"})
    EXPECT_FALSE(HttpServer::start(api, {.listen = nowhere}).ok()) << nowhere;
}

TEST_F(ServerHttpTlsThreads, ATokenIsShownAsHeaderOrCookieAndAnAddressWithItGivesTheCookie) {
  serve(options());
  EXPECT_THAT(server->url(), StartsWith("https://0.0.0.0:"));
  const auto get = [&](const std::string& target, const std::string& headers) {
    return ask(port, "GET", target, "", "Host: lab:7140\r\n" + headers);
  };
  EXPECT_EQ(get("/metrics", "").status, 401);
  EXPECT_EQ(ask(port, "POST", "/api/v1/Daemon/GetStatus", "", "Host: lab:7140\r\n").status, 401);
  EXPECT_EQ(get("/metrics", "Authorization: Bearer 0123456789abcdeX\r\n").status, 401);
  EXPECT_EQ(get("/?token=wrong", "Cookie: emberlock_session_7140=wrong\r\n").status, 401);
  EXPECT_EQ(get("/metrics", "Authorization: Bearer 0123456789abcdef\r\n").status, 200);
  EXPECT_EQ(get("/healthz", "").status, 200);  // tells nothing but that
  const HttpAnswer moved = get("/?token=0123456789abcde%66", "");
  EXPECT_EQ(moved.status, 303);
  EXPECT_THAT(moved.head, HasSubstr("Location: /\r\n"));
  const std::string cookie = test::cookie_of(moved);
  EXPECT_THAT(cookie, MatchesRegex("emberlock_session_7140=[0-9a-f]{64}")) << "no token lies in the browser";
  EXPECT_THAT(moved.head, HasSubstr("; Path=/; HttpOnly; SameSite=Strict; Max-Age=2592000; Secure"));
  EXPECT_EQ(get("/metrics", "Cookie: theme=dark; " + cookie + "\r\n").status, 200);
}

TEST_F(ServerHttpTlsThreads, CallsJobsAndMetricsAnswerAsInPlain) {
  api.on_record = test::recording_of_that_name;
  api.on_job = test::job_that_tells(100);
  serve(options());
  EXPECT_EQ(json::parse(ask(port, "POST", "/api/v1/Capture/Record", R"({"name": "a"})", kShown).body),
            json({{"session", "a"}}));
  EXPECT_THAT(ask(port, "POST", "/api/v1/Sessions/Verify", R"({"session": "a"})", kShown).body,
              EndsWith("\n\r\n0\r\n\r\n"));
  EXPECT_THAT(ask(port, "GET", "/metrics", "", kShown).body,
              HasSubstr("emberlock_phase{state=\"locked\"} 1\n"));
  // More than a record of TLS holds, both ways.
  const std::string name(500'000, 'n');
  EXPECT_EQ(
      json::parse(ask(port, "POST", "/api/v1/Capture/Record", R"({"name": ")" + name + "\"}", kShown).body),
      json({{"session", name}}));
}

TEST_F(ServerHttpTlsThreads, AConsoleWatchesUntilItGoes) {
  serve(options());
  {
    test::WatchClient console(port, kShown);
    ASSERT_TRUE(console.open()) << console.answer();
    const auto first = console.hear();
    ASSERT_TRUE(first);
    EXPECT_EQ(json::parse(first->bytes)["status"]["phase"], "LOCKED");
    api.board().notice(v1::GREEN, "Over TLS.");
    const auto notice = console.hear();
    ASSERT_TRUE(notice);
    EXPECT_EQ(json::parse(notice->bytes)["notice"]["text"], "Over TLS.");
    EXPECT_EQ(server->viewers(), 1U);
    console.say("", 8);
  }
  EXPECT_TRUE(wait_until([&] { return server->viewers() == 0; }));
}

TEST_F(ServerHttpTlsThreads, WhoSpeaksPlainHttpIsToldToSpeakTls) {
  serve(options());
  const HttpAnswer answer = ask(server->port(), "GET", "/?token=" + kToken);
  EXPECT_EQ(answer.status, 400);
  EXPECT_THAT(answer.head, HasSubstr("Content-Length: " + std::to_string(answer.body.size())));
  EXPECT_THAT(answer.body, HasSubstr("https://"));
  EXPECT_EQ(test::ask_raw(server->port(), "this is neither\r\n\r\n").status, 0);
  EXPECT_EQ(ask(port, "GET", "/metrics", "", kShown).status, 200);
}

TEST_F(ServerHttpTlsThreads, WhoStallsInTheHandshakeIsCutOffAndHoldsNobodyUp) {
  HttpServerOptions patient = options();
  patient.patience = milliseconds(200);
  serve(patient);
  const UniqueFd silent = test::connect_to(server->port());
  const UniqueFd halfway = test::connect_to(server->port());
  test::send_all(halfway, std::string("\x16\x03\x01\x02\x00\x01", 6));
  // On a busy machine any client may seem to stall.
  EXPECT_TRUE(wait_until([&] { return ask(port, "GET", "/metrics", "", kShown).status == 200; }));
  EXPECT_THAT(test::read_to_end(silent), IsEmpty());
  EXPECT_THAT(test::read_to_end(halfway), IsEmpty());
}

TEST_F(ServerHttpTlsThreads, WithAnAuthorityForClientsWhoHasNoCertificateOfItsIsNotHeardAtAll) {
  const test::CertificateAuthority clients("who signs clients");
  HttpServerOptions strict = options();
  strict.tls->clients = clients.pem();
  serve(strict);
  const auto status_for = [&](const rig::TlsIdentity& identity) {
    const test::TlsTunnel own(server->port(), servers.pem(), identity);
    return ask(own.port(), "GET", "/metrics", "", kShown).status;
  };
  EXPECT_EQ(status_for(clients.issue("operator")), 200);
  EXPECT_EQ(status_for({}), 0);
  EXPECT_EQ(status_for(servers.issue("operator")), 0);
  EXPECT_THAT(api.calls(), IsEmpty());
}

TEST_F(ServerHttpTlsThreads, TheServerGoesWhileConsolesWatch) {
  serve(options());
  test::WatchClient console(port, kShown);
  ASSERT_TRUE(console.hear());
  server.reset();
  while (console.hear()) continue;
}

}  // namespace
}  // namespace emberlock::daemon
