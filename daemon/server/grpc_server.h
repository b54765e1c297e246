// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "daemon/api.h"
#include "daemon/server/auth_failures.h"
#include "daemon/server/console_sessions.h"
#include "rig/access.h"

namespace emberlock::daemon {

struct GrpcServerOptions {
  /// A Unix socket; its folder's mode controls access. Empty: none.
  std::filesystem::path socket = {};
  /// The lock of the socket, if the caller took it before it opened devices; else it is taken at the start.
  std::shared_ptr<const rig::SocketLock> lock = {};
  /// "192.168.0.5:7410", "0.0.0.0:7410", "[::]:7410": for remote clients, which need TLS and the token.
  /// Empty: none.
  std::string tcp_address = {};
  std::optional<rig::ServerTls> tls = {};
  std::optional<rig::Token> token = {};
  std::shared_ptr<ConsoleSessions> sessions = {};  ///< of the console, for OpenConsole; if null, a new one
  std::shared_ptr<AuthFailures> failures = {};     ///< counts refusals; if null, a new one

  std::size_t workers = 4;    ///< concurrent calls
  std::size_t waiting = 32;   ///< queued calls; beyond it RESOURCE_EXHAUSTED
  std::size_t watchers = 64;  ///< open streams; beyond it RESOURCE_EXHAUSTED
  int streams_a_connection = 64;
  int largest_request = 1 << 20;  ///< bytes
  /// A client silent for this long is pinged, and disconnected if it doesn't answer within half as long.
  Seconds keepalive{10};
};

/// The Api over gRPC (services.proto), and grpc.health.v1, which reports serving after the engine's first
/// status. Serves while it exists; the Api must outlive it.
class GrpcServer {
 public:
  /// Errors: refused where another daemon holds the socket; bad_input for invalid addresses, and for TCP
  /// without TLS or token; io.
  static Result<std::unique_ptr<GrpcServer>> start(Api& api, GrpcServerOptions options);
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;
  /// Ends streams and jobs at once; waits for running calls.
  ~GrpcServer();

  /// The port of tcp_address; 0 if there is none.
  [[nodiscard]] int tcp_port() const;
  /// Number of open streams.
  [[nodiscard]] std::size_t watchers() const;

 private:
  struct Parts;
  explicit GrpcServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace emberlock::daemon
