// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include <grpcpp/server_builder.h>

#include "daemon/api.h"
#include "daemon/server/console_sessions.h"
#include "daemon/server/grpc_streams.h"
#include "daemon/server/workers.h"

namespace emberlock::daemon {

/// What the services of services.proto share.
struct GrpcBackend {
  Api& api;
  Workers& workers;  ///< for calls
  Workers& jobs;     ///< for what may take minutes
  StreamPump& pump;
  ConsoleSessions& sessions;
};

/// All of services.proto, over an Api. What it refers to outlives the server that has them.
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
