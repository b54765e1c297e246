// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/lending_server.h"

#include <chrono>
#include <utility>

#include <grpc/grpc_security_constants.h>
#include <grpcpp/grpcpp.h>

#include "base/clock.h"
#include "base/log.h"
#include "daemon/server/errors.h"
#include "emberlock/v1/hosts.grpc.pb.h"
#include "rig/access.h"

namespace emberlock::daemon {
namespace {

constexpr Seconds kLook = milliseconds(200);  // for a leader that is gone
constexpr int kAliveEveryMs = 2000;
constexpr int kLargestQuestion = 16 << 20;  // the colours of 64 cameras

/// The name is the request's; the certificate is the connection's, which gRPC has verified.
template <class Request>
Borrower leader_of(const grpc::ServerContext& context, const Request& request) {
  const auto certificate = context.auth_context()->FindPropertyValues(GRPC_X509_PEM_CERT_PROPERTY_NAME);
  return {request.leader(),
          certificate.empty() ? std::string() : std::string(certificate[0].data(), certificate[0].size())};
}

class LendingService final : public v1::Lending::Service {
 public:
  explicit LendingService(Lender& lender) : lender_(lender) {}

  grpc::Status Borrow(grpc::ServerContext* context, const v1::LeaderRequest* request,
                      v1::LentCameras* cameras) override {
    return put(lender_.lend(leader_of(*context, *request)), *cameras);
  }
  grpc::Status Clock(grpc::ServerContext* context, const v1::LeaderRequest* request,
                     v1::HostClock* clock) override {
    clock->set_monotonic_ns(SteadyClock().now().ns);
    return grpc_status(lender_.hear(leader_of(*context, *request)));
  }
  grpc::Status Frames(grpc::ServerContext* context, const v1::FramesRequest* request,
                      grpc::ServerWriter<v1::LentFrame>* stream) override {
    const auto frames = lender_.watch(leader_of(*context, *request), *request);
    if (!frames) return grpc_status(frames.error());
    while (!context->IsCancelled()) {
      auto next = (*frames)->next(kLook);
      if (!next.ok()) return grpc_status(next.error());
      if (*next && !stream->Write(**next)) break;
    }
    return grpc::Status::OK;
  }
  grpc::Status Reset(grpc::ServerContext* context, const v1::ResetRequest* request,
                     v1::Empty* /*done*/) override {
    return grpc_status(lender_.reset(leader_of(*context, *request), *request));
  }
  grpc::Status Trim(grpc::ServerContext* context, const v1::TrimRequest* request,
                    v1::Empty* /*done*/) override {
    return grpc_status(lender_.trim(leader_of(*context, *request), *request));
  }
  grpc::Status Record(grpc::ServerContext* context, const v1::PartRequest* request,
                      v1::HostPart* part) override {
    if (context->IsCancelled()) return grpc::Status::CANCELLED;  // its leader doesn't wait any more
    return put(lender_.record_part(leader_of(*context, *request), *request), *part);
  }
  grpc::Status StopPart(grpc::ServerContext* context, const v1::StopPartRequest* request,
                        v1::Empty* /*done*/) override {
    return grpc_status(lender_.stop_part(leader_of(*context, *request), *request));
  }
  grpc::Status Part(grpc::ServerContext* context, const v1::FindPartRequest* request,
                    v1::HostPart* part) override {
    auto found = lender_.part(leader_of(*context, *request), *request);
    if (!found && found.error().kind == ErrorKind::out_of_data)
      return {grpc::StatusCode::NOT_FOUND, found.error().message()};
    return put(std::move(found), *part);
  }

 private:
  template <class Answer>
  static grpc::Status put(Result<Answer> result, Answer& answer) {
    if (!result) return grpc_status(result.error());
    answer = std::move(*result);
    return grpc::Status::OK;
  }

  Lender& lender_;
};

}  // namespace

struct LendingServer::Parts {
  explicit Parts(Lender& lender) : service(lender) {}
  LendingService service;
  int port = 0;
  std::unique_ptr<grpc::Server> server;
};

Result<std::unique_ptr<LendingServer>> LendingServer::start(Lender& lender, const rig::HostsConfig& hosts) {
  EMBERLOCK_ASSIGN_OR_RETURN(rig::ServerTls tls,
                             rig::ServerTls::read(hosts.certificate, hosts.key, hosts.authority));
  grpc::SslServerCredentialsOptions ssl(GRPC_SSL_REQUEST_AND_REQUIRE_CLIENT_CERTIFICATE_AND_VERIFY);
  ssl.pem_root_certs = tls.clients;
  ssl.pem_key_cert_pairs.push_back({tls.identity.key, tls.identity.certificate});
  auto parts = std::make_unique<Parts>(lender);
  grpc::ServerBuilder builder;
  builder.SetMaxReceiveMessageSize(kLargestQuestion);
  builder.AddChannelArgument(GRPC_ARG_ALLOW_REUSEPORT, 0);
  // A leader that is cut off is noticed; and it may ask whether this one is.
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIME_MS, kAliveEveryMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_TIMEOUT_MS, kAliveEveryMs);
  builder.AddChannelArgument(GRPC_ARG_KEEPALIVE_PERMIT_WITHOUT_CALLS, 1);
  builder.AddChannelArgument(GRPC_ARG_HTTP2_MIN_RECV_PING_INTERVAL_WITHOUT_DATA_MS, kAliveEveryMs / 4);
  builder.AddListeningPort(hosts.listen, grpc::SslServerCredentials(ssl), &parts->port);
  builder.RegisterService(&parts->service);
  parts->server = builder.BuildAndStart();
  if (!parts->server)
    return Error{ErrorKind::io, "nothing can listen there", hosts.listen,
                 "the log says why; is the port taken, the address another machine's?"};
  log(LogCategory::daemon).info("lends its cameras at {}", hosts.listen);
  return std::unique_ptr<LendingServer>(new LendingServer(std::move(parts)));
}

LendingServer::LendingServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

LendingServer::~LendingServer() { parts_->server->Shutdown(std::chrono::system_clock::now()); }

int LendingServer::port() const { return parts_->port; }

}  // namespace emberlock::daemon
