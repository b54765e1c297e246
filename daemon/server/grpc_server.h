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
  /// Unix socket; its folder says who may use it. Empty: none.
  std::filesystem::path socket = {};
  /// Of the socket, for who took it before it opened devices; else it is taken at the start.
  std::shared_ptr<const rig::SocketLock> lock = {};
  /// "192.168.0.5:7410", "0.0.0.0:7410", "[::]:7410": clients from elsewhere, who need TLS and the token.
  /// Empty: none.
  std::string tcp_address = {};
  std::optional<rig::ServerTls> tls = {};
  std::optional<rig::Token> token = {};
  std::shared_ptr<ConsoleSessions> sessions = {};  ///< of the console, for OpenConsole; its own if null
  std::shared_ptr<AuthFailures> failures = {};     ///< counts who isn't let in; its own if null

  std::size_t workers = 4;   ///< calls at a time
  std::size_t waiting = 32;  ///< more that queue; beyond it RESOURCE_EXHAUSTED
  std::size_t jobs = 2;      ///< verify, repair and export at a time
  std::size_t waiting_jobs = 8;
  std::size_t watchers = 64;  ///< open streams; beyond it RESOURCE_EXHAUSTED
  int streams_a_connection = 64;
  int largest_request = 1 << 20;  ///< bytes
  /// A client that answers nothing for this long is asked, and gone if it hasn't answered half as long after.
  Seconds keepalive{10};
};

/// The Api over gRPC (services.proto), and grpc.health.v1: it serves from the engine's first status on.
/// Serves while it lives; the Api must outlive it.
class GrpcServer {
 public:
  /// Errors: refused where another daemon has the socket, bad_input for addresses and for TCP without TLS or
  /// token, io.
  static Result<std::unique_ptr<GrpcServer>> start(Api& api, GrpcServerOptions options);
  GrpcServer(const GrpcServer&) = delete;
  GrpcServer& operator=(const GrpcServer&) = delete;
  /// Ends streams and jobs at once; calls that run are waited for.
  ~GrpcServer();

  /// The port of tcp_address; 0 without.
  [[nodiscard]] int tcp_port() const;
  /// Open streams.
  [[nodiscard]] std::size_t watchers() const;

 private:
  struct Parts;
  explicit GrpcServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace emberlock::daemon
