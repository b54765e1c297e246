// SPDX-License-Identifier: Apache-2.0
// `emberlock status --daemon HOST:PORT`, against a server that speaks TLS: who is right gets in, and who
// isn't is told which of the two certificates or the token stands in the way, where, and what to do.
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include "base/unique_fd.h"
#include "cli/client.h"
#include "cli/commands.h"
#include "daemon/server/grpc_server.h"
#include "daemon/server/http_server.h"
#include "tests/support/certificate.h"
#include "tests/support/fake_api.h"
#include "tests/support/http_client.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::string kToken = "0123456789abcdef";

class ClientTls : public testing::Test {
 protected:
  ClientTls() {
    v1::DaemonStatus status;
    status.set_rig("bench");
    api_.board().show(status);
    write("ca.crt", servers_.pem());
    write("token", kToken + "\n");
  }
  void write(const std::string& name, const std::string& text) { test::write_secret(folder_ / name, text); }
  void write(const std::string& name, const rig::TlsIdentity& identity) {
    write(name + ".crt", identity.certificate);
    write(name + ".key", identity.key);
  }
  void serve(rig::ServerTls tls) {
    auto started = daemon::GrpcServer::start(
        api_, {.tcp_address = "127.0.0.1:0", .tls = std::move(tls), .token = *rig::Token::parse(kToken)});
    ASSERT_TRUE(started.ok()) << started.error().message();
    server_ = std::move(*started);
    where_ = "localhost:" + std::to_string(server_->tcp_port());
  }
  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  /// `status` with the right CA and token, and `more`; an option said again counts.
  test::VerbRun status(std::vector<std::string> more = {}, std::string ca = "ca.crt",
                       std::string token = "token") const {
    std::vector<std::string> words{"status", "--daemon",     where_,     "--tls-ca",
                                   path(ca), "--token-file", path(token)};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_verb(add_status, std::move(words));
  }
  /// That it failed at `where_` for the option's sake, with these words.
  template <class Words>
  void expect_refused(const test::VerbRun& run, Words words) const {
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_EQ(run.out, "");
    EXPECT_THAT(run.err, AllOf(HasSubstr(where_), words));
  }

  test::TempFolder folder_;
  test::CertificateAuthority servers_{"the lab"};
  test::CertificateAuthority strangers_{"somebody else"};
  test::FakeApi api_;
  std::unique_ptr<daemon::GrpcServer> server_;
  std::string where_;
};

TEST_F(ClientTls, TheRightAuthorityAndTokenAreAnswered) {
  serve({servers_.issue("localhost")});
  const test::VerbRun run = status();
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("bench"));
}

TEST_F(ClientTls, ADaemonThatTheAuthorityDoesNotVouchForIsToldApart) {
  serve({servers_.issue("localhost")});
  write("other.crt", strangers_.pem());
  expect_refused(status({}, "other.crt"), HasSubstr("--tls-ca doesn't vouch for the daemon's certificate"));
}

TEST_F(ClientTls, ACertificateForAnotherNameIsToldApart) {
  serve({servers_.issue("elsewhere.example")});
  expect_refused(status(), HasSubstr("the daemon's certificate is for another name"));
}

TEST_F(ClientTls, AWrongTokenIsToldApart) {
  serve({servers_.issue("localhost")});
  write("wrong", "0123456789abcdeX");
  expect_refused(status({}, "ca.crt", "wrong"),
                 AllOf(HasSubstr("the daemon doesn't know the token"), HasSubstr("Give --token-file")));
}

TEST_F(ClientTls, WhereClientsMustHaveACertificateNoneIsToldApartAndTheRightOneIsAnswered) {
  const test::CertificateAuthority clients("who signs clients");
  serve({servers_.issue("localhost"), clients.pem()});
  expect_refused(status(), AllOf(HasSubstr("the daemon wants a certificate of its clients"),
                                 HasSubstr("Give --tls-certificate and --tls-key")));
  write("client", clients.issue("operator"));
  const std::vector<std::string> own{"--tls-certificate", path("client.crt"), "--tls-key",
                                     path("client.key")};
  EXPECT_EQ(status(own).exit_code, 0) << status(own).err;
  // The token is asked for all the same.
  write("wrong", "0123456789abcdeX");
  expect_refused(status(own, "ca.crt", "wrong"), HasSubstr("token"));
}

TEST_F(ClientTls, ACertificateThatAnotherAuthoritySignedIsRefused) {
  const test::CertificateAuthority clients("who signs clients");
  serve({servers_.issue("localhost"), clients.pem()});
  write("client", strangers_.issue("operator"));
  expect_refused(status({"--tls-certificate", path("client.crt"), "--tls-key", path("client.key")}),
                 AllOf(HasSubstr("refuses this client's certificate"), HasSubstr("Give --tls-certificate")));
}

TEST_F(ClientTls, OptionsThatAreWrongAreToldBeforeAnythingIsAsked) {
  where_ = "localhost:1";
  write("client", servers_.issue("operator"));
  expect_refused(status({"--tls-certificate", path("client.crt")}), HasSubstr("Give both"));
  write("another", servers_.issue("operator"));
  EXPECT_THAT(status({"--tls-certificate", path("client.crt"), "--tls-key", path("another.key")}).err,
              AllOf(HasSubstr("another.key"), HasSubstr("is not the key of")));
  EXPECT_THAT(status({}, "absent.crt").err, HasSubstr("absent.crt"));
  write("empty", "\n");
  EXPECT_THAT(status({}, "ca.crt", "empty").err, AllOf(HasSubstr("empty"), HasSubstr("holds no token")));
  write("public", kToken);
  ASSERT_EQ(::chmod(path("public").c_str(), 0644), 0);
  EXPECT_THAT(status({}, "ca.crt", "public").err,
              AllOf(HasSubstr("everybody may read or write the token"), HasSubstr("chmod o=")));
}

TEST_F(ClientTls, APortWhereNobodyListensAndANameThatLeadsNowhereAreUnreachable) {
  // A port that is taken, so that no other process listens there.
  const UniqueFd taken(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  sockaddr_in address{
      .sin_family = AF_INET, .sin_port = 0, .sin_addr = {::htonl(INADDR_LOOPBACK)}, .sin_zero = {}};
  auto* const as_address = reinterpret_cast<sockaddr*>(&address);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(taken.get(), as_address, size), 0);
  ASSERT_EQ(::getsockname(taken.get(), as_address, &size), 0);
  where_ = "localhost:" + std::to_string(::ntohs(address.sin_port));
  const test::VerbRun nobody = status();
  EXPECT_EQ(nobody.exit_code, kUnreachable);
  EXPECT_THAT(nobody.err, AllOf(HasSubstr(where_), HasSubstr("Connection refused"), HasSubstr("`listen`")));
  where_ = "no-such-host.invalid:7141";
  EXPECT_EQ(status().exit_code, kUnreachable);
  where_ = "localhost";
  EXPECT_THAT(status().err, HasSubstr("HOST:PORT"));
}

TEST_F(ClientTls, APortOfThePlainConsoleIsToldApart) {
  auto console = daemon::HttpServer::start(api_, {.listen = "127.0.0.1:0"});
  ASSERT_TRUE(console.ok());
  where_ = "localhost:" + std::to_string((*console)->port());
  expect_refused(status(), AllOf(HasSubstr("speaks no TLS"), HasSubstr("`listen`")));
}

TEST_F(ClientTls, APortOfTheConsoleOverTlsIsToldApart) {
  auto console = daemon::HttpServer::start(api_, {.listen = "0.0.0.0:0",
                                                  .token = *rig::Token::parse(kToken),
                                                  .tls = rig::ServerTls{servers_.issue("localhost")}});
  ASSERT_TRUE(console.ok()) << console.error().message();
  where_ = "localhost:" + std::to_string((*console)->port());
  expect_refused(status(), HasSubstr("not of `http_listen`"));
}

TEST_F(ClientTls, WhoSpeaksNoTlsIsHungUpOnAndTheNextIsServed) {
  serve({servers_.issue("localhost")});
  EXPECT_THAT(test::ask_raw(server_->tcp_port(), "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n").body, "");
  EXPECT_EQ(status().exit_code, 0);
}

TEST_F(ClientTls, WithoutAuthorityOrTokenADaemonElsewhereIsNotAsked) {
  const test::VerbRun run = test::run_verb(add_status, {"status", "--daemon", "lab:7141"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("lab:7141"), HasSubstr("--tls-ca"), HasSubstr("--token-file")));
}

}  // namespace
}  // namespace emberlock::cli
