// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include <grpcpp/server_builder.h>

#include "daemon/api.h"
#include "daemon/server/console_sessions.h"
#include "daemon/server/grpc_streams.h"
#include "daemon/work/workers.h"

namespace emberlock::daemon {

/// Shared by the services of services.proto.
struct GrpcBackend {
  Api& api;
  Workers& workers;  ///< for calls
  StreamPump& pump;
  ConsoleSessions& sessions;
};

/// All services of services.proto, for an Api. The objects that it refers to must outlive the server.
class GrpcServices {
 public:
  explicit GrpcServices(GrpcBackend backend);
  GrpcServices(const GrpcServices&) = delete;
  GrpcServices& operator=(const GrpcServices&) = delete;
  ~GrpcServices();

  void add_to(grpc::ServerBuilder& builder);

 private:
  struct All;
  std::unique_ptr<All> all_;
};

}  // namespace emberlock::daemon
