// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
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

struct HttpServerOptions {
  std::string listen = "127.0.0.1:7140";  ///< "address:port", "[::1]:7140"; port 0: any that is free
  std::optional<rig::Token> token = {};   ///< lets in who shows it; beyond this machine it must be there
  /// Spoken to everybody if `listen` isn't of this machine alone, and then it must be there.
  std::optional<rig::ServerTls> tls = {};
  std::shared_ptr<ConsoleSessions> sessions = {};  ///< browsers that are let in; its own if null
  std::shared_ptr<AuthFailures> failures = {};     ///< counts who isn't; its own if null
  std::filesystem::path console =
      {};  ///< its files; where there are none the API is served alone, and a page that says so
  std::size_t viewers = 64;       ///< WebSockets; beyond it one makes room: crowd.h
  std::size_t connections = 256;  ///< others; beyond it likewise, strangers first
  std::size_t workers = 4;        ///< calls at a time
  std::size_t waiting = 32;       ///< more that queue; beyond it 429
  std::size_t jobs = 2;           ///< verify, repair and export at a time
  std::size_t waiting_jobs = 8;
  std::uint32_t largest_header = 16 << 10;  ///< bytes
  std::uint64_t largest_body = 1 << 20;     ///< bytes
  std::size_t largest_wish = 64 << 10;      ///< bytes of a message from a viewer
  Seconds patience{15};  ///< for TLS to begin, for a whole header or body, for a client to take an answer,
                         ///< for a sign of life of a viewer
  std::function<std::size_t()> other_watchers =
      {};  ///< for /metrics: those that aren't viewers here (gRPC's)
};

/// The console and the API over HTTP/1.1, beyond this machine over TLS, from one thread, for who is let in
/// (http_request.h); who isn't is told at / what to do.
///   GET /, /assets/...           the console
///   GET /open?link=L, POST /open  a session's cookie, for a link or for a form's token
///   POST /api/v1/<Service>/<Method>  json_api.h; jobs answer with one JSON object a line, as they go
///   GET /api/v1/watch            WebSocket: watch_messages.h
///   GET /metrics                 for Prometheus;  GET /healthz: 200 once the engine runs, for everybody
/// Serves while it lives; the Api must outlive it.
class HttpServer {
 public:
  /// Errors: bad_input for an address that is none or that needs token and TLS, io where the port is taken.
  static Result<std::unique_ptr<HttpServer>> start(Api& api, HttpServerOptions options);
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  /// Ends connections and jobs at once; calls that run are waited for.
  ~HttpServer();

  [[nodiscard]] int port() const;
  /// "https://0.0.0.0:7140"
  [[nodiscard]] std::string url() const;
  [[nodiscard]] std::size_t viewers() const;

 private:
  struct Parts;
  explicit HttpServer(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace emberlock::daemon
