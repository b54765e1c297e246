// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/grpc_server.h"

#include <atomic>
#include <chrono>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <grpc/support/log.h>
#include <grpcpp/grpcpp.h>
#include <grpcpp/health_check_service_interface.h>
#include <sys/stat.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/server/grpc_services.h"
#include "daemon/server/repeat_filter.h"

namespace emberlock::daemon {
namespace {

/// Redirects gRPC's own messages to our log.
void log_grpc(gpr_log_func_args* args) {
  static RepeatFilter& filter = *new RepeatFilter;  // gRPC's threads log until the process ends
  spdlog::logger& logger = log(LogCategory::daemon);
  if (args->severity == GPR_LOG_SEVERITY_ERROR) {
    const auto held_back = filter.pass(args->file, args->line, SteadyClock().now());
    if (!held_back) return;
    const std::string more =
        *held_back > 0 ? fmt::format(" ({} like it in between)", *held_back) : std::string();
    return logger.warn("gRPC: {}{}", args->message, more);
  }
  switch (args->severity) {
    case GPR_LOG_SEVERITY_DEBUG:
      logger.debug("gRPC: {}", args->message);
      break;
    case GPR_LOG_SEVERITY_INFO:
      logger.info("gRPC: {}", args->message);
      break;
    case GPR_LOG_SEVERITY_ERROR:
      break;
  }
}

/// Lets in clients with the token, in metadata "authorization: Bearer TOKEN". gRPC calls this on separate
/// threads, not on those of other clients' calls, so guesses can be delayed. The client is unknown here, so
/// all guesses by gRPC count as one source.
class TokenCheck final : public grpc::AuthMetadataProcessor {
 public:
  TokenCheck(rig::Token token, std::shared_ptr<AuthFailures> failures)
      : token_(std::move(token)), failures_(std::move(failures)) {}
  [[nodiscard]] bool IsBlocking() const override { return true; }
  grpc::Status Process(const InputMetadata& shown, grpc::AuthContext* /*context*/, OutputMetadata* consumed,
                       OutputMetadata* /*response*/) override {
    constexpr std::string_view kScheme = "Bearer ";
    bool any = false;
    for (auto [at, end] = shown.equal_range("authorization"); at != end; ++at) {
      const std::string_view value(at->second.data(), at->second.size());
      any = true;
      if (!value.starts_with(kScheme) || !token_.matches(value.substr(kScheme.size()))) continue;
      consumed->insert({"authorization", std::string(value)});
      return grpc::Status::OK;
    }
    refuse(any ? Refusal::wrong_token : Refusal::nothing_shown);
    return {grpc::StatusCode::UNAUTHENTICATED,
            "emberlockd: the token is missing or wrong. Give the one of the daemon's token file"};
  }

 private:
  static constexpr int kMostWaiting = 16;  ///< threads; further guesses are answered at once

  void refuse(Refusal refusal) {
    const AuthFailures::Outcome outcome =
        failures_->note("grpc", "the network", refusal, SteadyClock().now());
    if (outcome.line) log(LogCategory::daemon).warn("{}", *outcome.line);
    if (outcome.delay == Seconds(0)) return;
    if (++waiting_ <= kMostWaiting)
      std::this_thread::sleep_for(std::chrono::duration<double>(outcome.delay.value()));
    --waiting_;
  }

  rig::Token token_;
  std::shared_ptr<AuthFailures> failures_;
  std::atomic<int> waiting_ = 0;
};

Status check(const GrpcServerOptions& options) {
  if (options.socket.empty() && options.tcp_address.empty())
    return Error{ErrorKind::bad_input, "nowhere to listen", "gRPC", "name a socket"};
  if (options.tcp_address.empty()) return {};
  if (!options.tls)
    return Error{ErrorKind::bad_input, "over a network only TLS is spoken, and there is no certificate",
                 options.tcp_address, "name a certificate and its key, or use the Unix socket alone"};
  if (!options.token)
    return Error{ErrorKind::bad_input, "over a network clients must show a token, and there is none",
                 options.tcp_address, "make one with `emberlockd --make-token FILE` and name the file"};
  return {};
}

void set_limits(grpc::ServerBuilder& builder, const GrpcServerOptions& options) {
  const int keepalive_ms = static_cast<int>(in_milliseconds(options.keepalive));
  builder.SetMaxReceiveMessageSize(options.largest_request);
  // A client that is silent in the TLS handshake keeps its descriptor for at most this time.
  builder.AddChannelArgument(GRPC_ARG_SERVER_HANDSHAKE_TIMEOUT_MS, keepalive_ms);
  builder.AddChannelArgument(GRPC_ARG_MAX_CONCURRENT_STREAMS, options.streams_a_connection);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT,
                             0);  // otherwise two daemons could share a port unnoticed
  // A write to a client that has vanished may never complete (gRPC issue 41492): pings detect that.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, keepalive_ms);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, keepalive_ms / 2);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MAX_PINGS_WITHOUT_DATA, 0);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, keepalive_ms / 2);
}

std::shared_ptr<grpc::ServerCredentials> network_credentials(const GrpcServerOptions& options) {
  grpc::SslServerCredentialsOptions ssl;
  ssl.pem_key_cert_pairs.push_back({options.tls->identity.key, options.tls->identity.certificate});
  if (!options.tls->clients.empty()) {
    ssl.pem_root_certs = options.tls->clients;
    ssl.client_certificate_request = GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY;
  }
  auto credentials = grpc::SslServerCredentials(ssl);
  credentials->SetAuthMetadataProcessor(std::make_shared<TokenCheck>(*options.token, options.failures));
  return credentials;
}

}  // namespace

struct GrpcServer::Parts {
  Parts(Api& api, const GrpcServerOptions& options)
      : workers(options.workers, options.waiting),
        pump(options.watchers),
        sessions(options.sessions),
        services({api, workers, pump, *sessions}) {}

  Status listen(const GrpcServerOptions& options);
  void follow(Board& board);

  // The server is destroyed first, while the rest still works.
  Workers workers;
  StreamPump pump;
  std::shared_ptr<ConsoleSessions> sessions;
  GrpcServices services;
  std::shared_ptr<const rig::SocketLock> lock;
  int tcp_port = 0;
  std::atomic<bool> serving = false;
  std::unique_ptr<grpc::Server> server;
  Subscription subscription;
};

Status GrpcServer::Parts::listen(const GrpcServerOptions& options) {
  grpc::ServerBuilder builder;
  set_limits(builder, options);
  services.add_to(builder);
  if (!options.socket.empty()) {
    lock = options.lock;
    if (!lock) {
      EMBERLOCK_ASSIGN_OR_RETURN(rig::SocketLock taken, rig::SocketLock::take(options.socket));
      lock = std::make_shared<const rig::SocketLock>(std::move(taken));
    }
    builder.AddListeningPort("unix:" + options.socket.string(), grpc::InsecureServerCredentials());
  }
  if (!options.tcp_address.empty())
    builder.AddListeningPort(options.tcp_address, network_credentials(options), &tcp_port);
  server = builder.BuildAndStart();
  if (!server)
    return Error{ErrorKind::io, "nothing can listen there",
                 fmt::format("{} {}", options.socket.string(), options.tcp_address),
                 "the log says why; is the port taken, the address another machine's?"};
  // Access is controlled by the socket's folder.
  if (!options.socket.empty()) ::chmod(options.socket.c_str(), S_IRUSR | S_IWUSR | S_IRGRP | S_IWGRP);
  return {};
}

void GrpcServer::Parts::follow(Board& board) {
  const auto show_health = [this, &board] {
    const bool serves = board.status()->phase() != v1::PHASE_UNSPECIFIED;
    if (serving.exchange(serves) != serves) server->GetHealthCheckService()->SetServingStatus(serves);
  };
  server->GetHealthCheckService()->SetServingStatus(false);
  subscription = board.subscribe([this, show_health](Board::Topic topic) {
    if (topic == Board::Topic::status) show_health();
    pump.wake();
  });
  show_health();
}

Result<std::unique_ptr<GrpcServer>> GrpcServer::start(Api& api, GrpcServerOptions options) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  if (!options.sessions) options.sessions = std::make_shared<ConsoleSessions>();
  if (!options.failures) options.failures = std::make_shared<AuthFailures>();
  gpr_set_log_function(log_grpc);
  grpc::EnableDefaultHealthCheckService(true);
  auto parts = std::make_unique<Parts>(api, options);
  EMBERLOCK_RETURN_IF_ERROR(parts->listen(options));
  parts->follow(api.board());
  return std::unique_ptr<GrpcServer>(new GrpcServer(std::move(parts)));
}

GrpcServer::GrpcServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

GrpcServer::~GrpcServer() {
  parts_->subscription = {};
  parts_->server->Shutdown(std::chrono::system_clock::now());
}

int GrpcServer::tcp_port() const { return parts_->tcp_port; }
std::size_t GrpcServer::watchers() const { return parts_->pump.streams(); }

}  // namespace emberlock::daemon
