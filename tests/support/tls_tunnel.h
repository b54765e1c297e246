// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <string>
#include <thread>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/stream.hpp>
#include <boost/asio/write.hpp>

#include "rig/access.h"

namespace emberlock::test {

/// A port of this machine from which what clients say in plain goes on over TLS to another: so that clients
/// that know no TLS can test who speaks it.
class TlsTunnel {
 public:
  /// To `port`, believing `ca`, and showing `identity` if there is one.
  TlsTunnel(int port, const std::string& ca, const rig::TlsIdentity& identity = {})
      : to_(boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(port)) {
    context_.set_verify_mode(boost::asio::ssl::verify_peer);
    context_.add_certificate_authority(boost::asio::buffer(ca));
    if (!identity.key.empty()) {
      context_.use_certificate_chain(boost::asio::buffer(identity.certificate));
      context_.use_private_key(boost::asio::buffer(identity.key), boost::asio::ssl::context::pem);
    }
    accept();
    thread_ = std::thread([this] { loop_.run(); });
  }
  TlsTunnel(const TlsTunnel&) = delete;
  TlsTunnel& operator=(const TlsTunnel&) = delete;
  ~TlsTunnel() {
    loop_.stop();
    thread_.join();
  }
  [[nodiscard]] int port() const { return acceptor_.local_endpoint().port(); }

 private:
  using Tcp = boost::asio::ip::tcp;
  using Code = boost::system::error_code;

  struct Pair : std::enable_shared_from_this<Pair> {
    Pair(Tcp::socket from, boost::asio::ssl::context& context)
        : client(std::move(from)), server(client.get_executor(), context) {}

    void run(const Tcp::endpoint& to) {
      Code failed;
      server.next_layer().connect(to, failed);
      server.async_handshake(boost::asio::ssl::stream_base::client, [self = shared_from_this()](Code error) {
        if (error) return self->close();
        self->pump(self->client, self->server, self->up);
        self->pump(self->server, self->client, self->down);
      });
    }
    template <class From, class To>
    void pump(From& from, To& to, std::array<char, 65536>& bytes) {
      from.async_read_some(boost::asio::buffer(bytes), [&, self = shared_from_this()](Code error,
                                                                                      std::size_t got) {
        if (error) return self->close();
        boost::asio::async_write(to, boost::asio::buffer(bytes, got), [&, self](Code failed, std::size_t) {
          if (failed) return self->close();
          self->pump(from, to, bytes);
        });
      });
    }
    void close() {
      Code ignored;
      client.close(ignored);
      server.next_layer().close(ignored);
    }
    Tcp::socket client;
    boost::asio::ssl::stream<Tcp::socket> server;
    std::array<char, 65536> up{}, down{};
  };

  void accept() {
    acceptor_.async_accept([this](Code error, Tcp::socket socket) {
      if (!error) std::make_shared<Pair>(std::move(socket), context_)->run(to_);
      if (acceptor_.is_open()) accept();
    });
  }

  Tcp::endpoint to_;
  boost::asio::io_context loop_;
  boost::asio::ssl::context context_{boost::asio::ssl::context::tls_client};
  Tcp::acceptor acceptor_{loop_, Tcp::endpoint(boost::asio::ip::address_v4::loopback(), 0)};
  std::thread thread_;
};

}  // namespace emberlock::test
