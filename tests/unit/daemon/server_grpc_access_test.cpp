// SPDX-License-Identifier: Apache-2.0
// Who may ask over gRPC, and at which addresses: sockets that are taken or left behind, tokens, TLS from both
// sides.
#include <chrono>
#include <fstream>
#include <future>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>

#include "tests/support/certificate.h"
#include "tests/support/grpc_server.h"
#include "tests/support/unix_socket.h"

namespace emberlock::daemon {
namespace {

using test::FakeApi;
using testing::HasSubstr;

using ServerGrpcAccess = test::GrpcServerTest;

TEST_F(ServerGrpcAccess, ASecondDaemonIsToldWhoHasTheSocketAndTheFirstGoesOn) {
  serve();
  FakeApi other;
  const auto second = GrpcServer::start(other, {.socket = socket});
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error().kind, ErrorKind::refused);
  EXPECT_THAT(second.error().message(), HasSubstr("pid " + std::to_string(::getpid())));
  v1::DaemonStatus status;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::Daemon::NewStub(channel())->GetStatus(&context, {}, &status).ok());
}

TEST_F(ServerGrpcAccess, ASocketThatAKilledDaemonLeftBehindIsReplaced) {
  // What SIGKILL leaves: the socket and the file that was locked.
  { const UniqueFd left = test::unix_socket(socket, ::bind); }
  std::ofstream(socket.string() + ".lock") << "12345678";
  show(v1::LOCKED);
  serve();
  v1::DaemonStatus status;
  grpc::ClientContext context;
  EXPECT_TRUE(v1::Daemon::NewStub(channel())->GetStatus(&context, {}, &status).ok());
  EXPECT_EQ(status.phase(), v1::LOCKED);
}

TEST_F(ServerGrpcAccess, AFileInTheSocketsPlaceIsLeftAlone) {
  std::ofstream(socket) << "precious";
  const auto started = GrpcServer::start(api, {.socket = socket});
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message(), HasSubstr("no socket"));
  EXPECT_TRUE(std::filesystem::exists(socket));
}

TEST_F(ServerGrpcAccess, TheSocketIsForItsGroupAlone) {
  serve();
  struct stat status {};
  ASSERT_EQ(::stat(socket.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0660U);
}

TEST_F(ServerGrpcAccess, OverTcpWithoutTlsItRefusesToStart) {
  const auto token = rig::Token::parse("0123456789abcdef");
  ASSERT_TRUE(token.ok());
  const auto started = GrpcServer::start(api, {.tcp_address = "127.0.0.1:0", .token = *token});
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message(), HasSubstr("only TLS is spoken"));
}

/// With a certificate of its own, on a port of its own.
class ServerGrpcTls : public ServerGrpcAccess {
 protected:
  void SetUp() override {
    options.tcp_address = "127.0.0.1:0";
    options.tls = rig::ServerTls{servers.issue("localhost")};
  }
  grpc::Status ask(const std::shared_ptr<grpc::ChannelCredentials>& credentials,
                   const std::string& authorization) {
    grpc::ClientContext context;
    if (!authorization.empty()) context.AddMetadata("authorization", authorization);
    v1::DaemonStatus status;
    return v1::Daemon::NewStub(
               grpc::CreateChannel("localhost:" + std::to_string(server->tcp_port()), credentials))
        ->GetStatus(&context, {}, &status);
  }
  std::shared_ptr<grpc::ChannelCredentials> trusting(const rig::TlsIdentity& showing = {}) const {
    return grpc::SslCredentials({servers.pem(), showing.key, showing.certificate});
  }
  test::CertificateAuthority servers{"who signs servers"};
  GrpcServerOptions options;
};

TEST_F(ServerGrpcTls, WithoutATokenItRefusesToStart) {
  const auto started = GrpcServer::start(api, options);
  ASSERT_FALSE(started.ok());
  EXPECT_THAT(started.error().message(), HasSubstr("--make-token"));
}

TEST_F(ServerGrpcTls, TheRightTokenIsLetInAndNoOther) {
  options.token = *rig::Token::parse("0123456789abcdef");
  serve(options);
  EXPECT_TRUE(ask(trusting(), "Bearer 0123456789abcdef").ok());
  for (const char* wrong :
       {"", "Bearer 0123456789abcdeF", "Bearer ", "0123456789abcdef", "Bearer 0123456789abcdef0"})
    EXPECT_EQ(ask(trusting(), wrong).error_code(), grpc::UNAUTHENTICATED) << wrong;
  EXPECT_EQ(ask(grpc::InsecureChannelCredentials(), "Bearer 0123456789abcdef").error_code(),
            grpc::UNAVAILABLE);
}

TEST_F(ServerGrpcTls, WithAnAuthorityForClientsWhoHasNoCertificateOfItsIsNotHeardAtAll) {
  const test::CertificateAuthority clients("who signs clients");
  options.token = *rig::Token::parse("0123456789abcdef");
  options.tls->clients = clients.pem();
  serve(options);
  EXPECT_TRUE(ask(trusting(clients.issue("operator")), "Bearer 0123456789abcdef").ok());
  EXPECT_EQ(ask(trusting(clients.issue("operator")), "Bearer 0123456789abcdeF").error_code(),
            grpc::UNAUTHENTICATED);
  for (const rig::TlsIdentity& wrong : {rig::TlsIdentity{}, servers.issue("operator")})
    EXPECT_EQ(ask(trusting(wrong), "Bearer 0123456789abcdef").error_code(), grpc::UNAVAILABLE);
}

TEST_F(ServerGrpcTls, GuessesAreCountedAndSlowedAndTheRightTokenIsNot) {
  options.token = *rig::Token::parse("0123456789abcdef");
  options.failures = std::make_shared<AuthFailures>();
  serve(options);
  constexpr int kGuesses = AuthFailures::kFree + 4;
  const auto begun = std::chrono::steady_clock::now();
  for (int i = 0; i < kGuesses; ++i)
    EXPECT_EQ(ask(trusting(), "Bearer 0123456789abcdeF").error_code(), grpc::UNAUTHENTICATED);
  EXPECT_GT(std::chrono::steady_clock::now() - begun, std::chrono::milliseconds(1500))
      << "0.1 + .2 + .4 + .8 s";
  auto guess = std::async(std::launch::async, [&] { return ask(trusting(), "Bearer 0123456789abcdeF"); });
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(ask(trusting(), "Bearer 0123456789abcdef").ok());
  EXPECT_EQ(guess.get().error_code(), grpc::UNAUTHENTICATED);
  EXPECT_EQ(options.failures->counts().at("grpc")[static_cast<std::size_t>(Refusal::wrong_token)],
            kGuesses + 1U);
}

TEST_F(ServerGrpcTls, LinksToTheConsoleAreGivenOverTheUnixSocketAlone) {
  options.token = *rig::Token::parse("0123456789abcdef");
  options.socket = socket;
  options.sessions = std::make_shared<ConsoleSessions>();
  serve(options);
  const auto open = [&](const std::shared_ptr<grpc::Channel>& by, v1::ConsoleLink& link) {
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer 0123456789abcdef");
    return v1::Daemon::NewStub(by)->OpenConsole(&context, {}, &link);
  };
  v1::ConsoleLink link;
  EXPECT_EQ(open(channel(), link).error_code(), grpc::FAILED_PRECONDITION) << "no console is served";
  options.sessions->serve_at("http://127.0.0.1:7140");
  ASSERT_TRUE(open(channel(), link).ok());
  EXPECT_THAT(link.url(), testing::StartsWith("http://127.0.0.1:7140/open?link="));
  EXPECT_EQ(link.valid_s(), 120);
  const auto network = grpc::CreateChannel("localhost:" + std::to_string(server->tcp_port()), trusting());
  const grpc::Status refused = open(network, link);
  EXPECT_EQ(refused.error_code(), grpc::PERMISSION_DENIED);
  EXPECT_THAT(refused.error_message(), HasSubstr("Unix socket"));
}

TEST_F(ServerGrpcTls, ATakenPortIsAnErrorAndNotShared) {
  options.token = *rig::Token::parse("0123456789abcdef");
  serve(options);
  options.tcp_address = "127.0.0.1:" + std::to_string(server->tcp_port());
  EXPECT_FALSE(GrpcServer::start(api, options).ok());
}

}  // namespace
}  // namespace emberlock::daemon
