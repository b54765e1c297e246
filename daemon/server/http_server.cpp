// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_server.h"

#include <charconv>
#include <thread>
#include <utility>

#include <boost/asio/ip/host_name.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <fmt/format.h>

#include "base/log.h"
#include "daemon/server/http_connection.h"
#include "daemon/server/http_context.h"

namespace emberlock::daemon {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;

Result<tcp::endpoint> parse_endpoint(const std::string& listen) {
  const Error wrong{ErrorKind::bad_input, "no address to listen at", listen,
                    R"(write it in numbers, with a port: "127.0.0.1:7140", "0.0.0.0:7140", "[::1]:7140")"};
  const std::size_t colon = listen.rfind(':');
  if (colon == std::string::npos) return wrong;
  std::string host = listen.substr(0, colon);
  if (host == "localhost") host = "127.0.0.1";
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  boost::system::error_code error;
  const auto address = asio::ip::make_address(host, error);
  unsigned short port = 0;
  const char* const end = listen.data() + listen.size();
  const auto parsed = std::from_chars(listen.data() + colon + 1, end, port);
  if (error || parsed.ec != std::errc() || parsed.ptr != end) return wrong;
  return tcp::endpoint(address, port);
}

Status listen_at(tcp::acceptor& acceptor, const tcp::endpoint& endpoint) {
  boost::system::error_code error;
  acceptor.open(endpoint.protocol(), error);
  if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor.bind(endpoint, error);
  if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
  if (!error) return {};
  return Error{ErrorKind::io, fmt::format("nothing can listen there: {}", error.message()),
               fmt::format("{}:{}", endpoint.address().to_string(), endpoint.port()),
               "choose another port, or stop who has it"};
}

/// The address for a browser; a server that listens on all addresses is reached by this machine's name.
std::string browser_url(const asio::ip::address& address, int port, std::string_view scheme) {
  boost::system::error_code unknown;
  std::string host = address.is_unspecified() ? asio::ip::host_name(unknown) : address.to_string();
  if (unknown) host = "localhost";
  if (!address.is_unspecified() && address.is_v6()) host = "[" + host + "]";
  return fmt::format("{}://{}:{}", scheme, host, port);
}

ConsoleFiles read_console(const std::filesystem::path& folder) {
  if (folder.empty()) return {};
  auto files = ConsoleFiles::read(folder);
  if (files) return std::move(*files);
  log(LogCategory::daemon).warn("no console: {}", files.error().message());
  return {};
}

}  // namespace

struct HttpServer::Parts {
  Parts(Api& api, HttpServerOptions options, HttpGate gate, ConsoleFiles console)
      : context(api, std::move(options), std::move(gate), std::move(console)) {}

  void accept();

  HttpContext context;
  tcp::acceptor acceptor{context.loop};
  asio::steady_timer pause{context.loop};
  Subscription subscription;
  std::thread thread;
  int port = 0;
};

void HttpServer::Parts::accept() {
  acceptor.async_accept([this](boost::system::error_code error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {
      // No file descriptor is free: try again later.
      pause.expires_after(std::chrono::milliseconds(100));
      return pause.async_wait([this](boost::system::error_code ended) {
        if (!ended) accept();
      });
    }
    if (context.make_room_for_a_connection())
      std::make_shared<HttpConnection>(context, std::move(socket))->run();
    accept();
  });
}

Result<std::unique_ptr<HttpServer>> HttpServer::start(Api& api, HttpServerOptions options) {
  EMBERLOCK_ASSIGN_OR_RETURN(const tcp::endpoint endpoint, parse_endpoint(options.listen));
  const bool this_machine_alone = endpoint.address().is_loopback();
  if (!this_machine_alone && !options.token)
    return Error{ErrorKind::bad_input, "whoever reaches this address must show a token, and there is none",
                 options.listen,
                 "make one with `emberlockd --make-token FILE` and name the file, or listen at 127.0.0.1"};
  if (!this_machine_alone && !options.tls)
    return Error{ErrorKind::bad_input, "beyond this machine only TLS is spoken, and there is no certificate",
                 options.listen, "name a certificate and its key, or listen at 127.0.0.1"};
  std::shared_ptr<asio::ssl::context> tls;
  if (!this_machine_alone) {
    EMBERLOCK_ASSIGN_OR_RETURN(tls, make_tls_context(*options.tls));
  }
  if (!options.sessions) options.sessions = std::make_shared<ConsoleSessions>();
  if (!options.failures) options.failures = std::make_shared<AuthFailures>();
  HttpGate gate(options.token, options.sessions,
                this_machine_alone ? HttpGate::Transport::plain : HttpGate::Transport::tls);
  ConsoleFiles console = read_console(options.console);
  auto parts = std::make_unique<Parts>(api, std::move(options), std::move(gate), std::move(console));
  parts->context.tls = std::move(tls);
  EMBERLOCK_RETURN_IF_ERROR(listen_at(parts->acceptor, endpoint));
  parts->port = parts->acceptor.local_endpoint().port();
  parts->context.options.sessions->serve_at(
      browser_url(endpoint.address(), parts->port, this_machine_alone ? "http" : "https"));
  parts->accept();
  parts->subscription =
      api.board().subscribe([&context = parts->context](Board::Topic /*topic*/) { context.wake(); });
  parts->thread = std::thread([&loop = parts->context.loop] { loop.run(); });
  return std::unique_ptr<HttpServer>(new HttpServer(std::move(parts)));
}

HttpServer::HttpServer(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

HttpServer::~HttpServer() {
  parts_->subscription = {};
  parts_->context.loop.stop();
  parts_->thread.join();
  for (const auto& job : parts_->context.jobs) job->leave();
}

int HttpServer::port() const { return parts_->port; }
std::string HttpServer::url() const {
  const std::string& listen = parts_->context.options.listen;
  return fmt::format("{}://{}:{}", parts_->context.tls ? "https" : "http",
                     listen.substr(0, listen.rfind(':')), parts_->port);
}
std::size_t HttpServer::viewers() const { return parts_->context.viewer_count; }

}  // namespace emberlock::daemon
