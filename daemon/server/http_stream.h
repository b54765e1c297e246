// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <utility>
#include <variant>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/role.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <boost/beast/websocket/ssl.hpp>
#include <boost/beast/websocket/teardown.hpp>

#include "rig/access.h"

namespace emberlock::daemon {

/// The OpenSSL settings for `tls`, TLS 1.2 or later. Error bad_input: OpenSSL refuses them.
Result<std::shared_ptr<boost::asio::ssl::context>> make_tls_context(const rig::ServerTls& tls);

/// A TCP or TLS connection behind one type that satisfies Boost.Asio's and Beast's stream concepts, so that
/// its users are independent of TLS. Its next layer is the TCP stream, which has the deadlines.
class HttpStream {
 public:
  using Tcp = boost::beast::tcp_stream;
  using Tls = boost::beast::ssl_stream<Tcp>;
  using executor_type = Tcp::executor_type;
  using next_layer_type = Tcp;

  /// `tls` null: plain TCP. It must outlive the stream.
  HttpStream(boost::asio::ip::tcp::socket socket, boost::asio::ssl::context* tls)
      : stream_(tls == nullptr ? Either(std::in_place_type<Tcp>, std::move(socket))
                               : Either(std::in_place_type<Tls>, Tcp(std::move(socket)), *tls)) {}

  executor_type get_executor() { return next_layer().get_executor(); }
  [[nodiscard]] bool is_tls() const { return std::holds_alternative<Tls>(stream_); }
  Tcp& next_layer() {
    Tls* const tls = std::get_if<Tls>(&stream_);
    return tls != nullptr ? tls->next_layer() : std::get<Tcp>(stream_);
  }

  template <class Buffers, class Handler>
  auto async_read_some(const Buffers& buffers, Handler&& handler) {
    return std::visit(
        [&](auto& stream) { return stream.async_read_some(buffers, std::forward<Handler>(handler)); },
        stream_);
  }
  template <class Buffers, class Handler>
  auto async_write_some(const Buffers& buffers, Handler&& handler) {
    return std::visit(
        [&](auto& stream) { return stream.async_write_some(buffers, std::forward<Handler>(handler)); },
        stream_);
  }

  /// The server's TLS handshake. Only with TLS.
  template <class Handler>
  void async_handshake(Handler&& handler) {
    std::get<Tls>(stream_).async_handshake(boost::asio::ssl::stream_base::server,
                                           std::forward<Handler>(handler));
  }
  /// Closes the stream in both directions.
  template <class Handler>
  void async_shutdown(Handler&& handler) {
    if (Tls* const tls = std::get_if<Tls>(&stream_))
      return tls->async_shutdown(std::forward<Handler>(handler));
    boost::beast::error_code error;
    next_layer().socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, error);
    boost::asio::post(get_executor(),
                      [handler = std::forward<Handler>(handler), error]() mutable { handler(error); });
  }

  /// Required by WebSocket.
  friend void teardown(boost::beast::role_type role, HttpStream& stream, boost::beast::error_code& error) {
    std::visit(
        [&](auto& inner) {
          using boost::beast::websocket::teardown;
          teardown(role, inner, error);
        },
        stream.stream_);
  }
  template <class Handler>
  friend void async_teardown(boost::beast::role_type role, HttpStream& stream, Handler&& handler) {
    std::visit(
        [&](auto& inner) {
          using boost::beast::websocket::async_teardown;
          async_teardown(role, inner, std::forward<Handler>(handler));
        },
        stream.stream_);
  }

 private:
  using Either = std::variant<Tcp, Tls>;
  Either stream_;
};

}  // namespace emberlock::daemon
