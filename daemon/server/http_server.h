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
#include "daemon/server/exported_file.h"
#include "rig/access.h"

namespace emberlock::daemon {

struct HttpServerOptions {
  std::string listen = "127.0.0.1:7140";  ///< "address:port", "[::1]:7140"; port 0: any free port
  std::optional<rig::Token> token = {};   ///< gives access; required for remote addresses
  /// Used for all connections if `listen` isn't a local address, and required then.
  std::optional<rig::ServerTls> tls = {};
  std::shared_ptr<ConsoleSessions> sessions = {};  ///< authenticated browsers; if null, a new one
  std::shared_ptr<AuthFailures> failures = {};     ///< counts refusals; if null, a new one
  std::filesystem::path console =
      {};  ///< the console's files; if there are none, only the API and a page that says so are served
  std::size_t viewers = 64;       ///< WebSockets; beyond it one is evicted: eviction.h
  std::size_t connections = 256;  ///< other connections; beyond it one is evicted, unauthenticated ones first
  std::size_t workers = 4;        ///< concurrent calls
  std::size_t waiting = 32;       ///< queued calls; beyond it 429
  std::uint32_t largest_header = 16 << 10;  ///< bytes
  std::uint64_t largest_body = 1 << 20;     ///< bytes
  std::size_t largest_wish = 64 << 10;      ///< bytes of a message from a viewer
  Seconds patience{15};  ///< for the TLS handshake, a complete header or body, a client to accept an answer,
                         ///< a viewer's sign of life
  std::function<std::size_t()> other_watchers =
      {};                           ///< for /metrics: the watchers outside this server (gRPC's)
  ExportFolder export_folder = {};  ///< if unset, no exported files are served
};

/// The console and the API over HTTP/1.1, with TLS if not local, on one thread, for authenticated clients
/// (http_request.h). Others get a page at / that says what to do.
///   GET /, /assets/...           the console
///   GET /open?link=L, POST /open  a session's cookie, for a link or for a form's token
///   POST /api/v1/<Service>/<Method>  json_api.h; jobs answer with one JSON object per line while they run
///   GET /api/v1/watch            WebSocket: watch_messages.h
///   GET /exports/SESSION/video/FILE  an exported video: exported_file.h
///   GET /metrics                 for Prometheus;  GET /healthz: 200 once the engine runs, for everybody
/// Serves while it exists; the Api must outlive it.
class HttpServer {
 public:
  /// Errors: bad_input for an invalid address, or one that requires token and TLS; io where the port is
  /// taken.
  static Result<std::unique_ptr<HttpServer>> start(Api& api, HttpServerOptions options);
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;
  /// Ends connections and jobs at once; waits for running calls.
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
