// SPDX-License-Identifier: Apache-2.0
#include "cli/tls_check.h"

#include <array>
#include <chrono>
#include <optional>
#include <utility>

#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/ssl/error.hpp>
#include <boost/beast/core/error.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>
#include <fmt/format.h>
#include <openssl/ssl.h>
#include <openssl/x509_vfy.h>

namespace emberlock::cli {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using asio::ip::tcp;

constexpr std::chrono::seconds kPatience{5};
/// ALPN for HTTP/2, as in gRPC.
constexpr std::array<unsigned char, 3> kHttp2{2, 'h', '2'};

struct HostPort {
  std::string host, port;
};
std::optional<HostPort> split(const std::string& address) {
  const std::size_t colon = address.rfind(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == address.size()) return std::nullopt;
  HostPort parts{address.substr(0, colon), address.substr(colon + 1)};
  if (parts.host.front() == '[' && parts.host.back() == ']')
    parts.host = parts.host.substr(1, parts.host.size() - 2);
  return parts;
}

/// OpenSSL copies the context into each connection, so it must be complete before.
asio::ssl::context context_of(const ClientTls& tls, beast::error_code& error) {
  asio::ssl::context context(asio::ssl::context::tls_client);
  context.set_verify_mode(asio::ssl::verify_peer);
  context.add_certificate_authority(asio::buffer(tls.ca), error);
  if (error || tls.identity.key.empty()) return context;
  context.use_certificate_chain(asio::buffer(tls.identity.certificate), error);
  if (!error) context.use_private_key(asio::buffer(tls.identity.key), asio::ssl::context::pem, error);
  return context;
}

class Handshake {
 public:
  Handshake(std::string address, const ClientTls& tls)
      : address_(std::move(address)),
        shows_certificate_(!tls.identity.key.empty()),
        context_(context_of(tls, error_)) {}

  Status run(const HostPort& to) {
    if (error_) return wrong(error_.message(), "Give --tls-ca, --tls-certificate and --tls-key files in PEM");
    tcp::resolver resolver(loop_);
    const auto found = resolver.resolve(to.host, to.port, error_);
    if (error_) return unreachable(error_.message(), "Give --daemon a name or address that leads to it");
    SSL* const ssl = stream_.native_handle();
    SSL_set_tlsext_host_name(ssl, to.host.c_str());
    SSL_set1_host(ssl, to.host.c_str());
    SSL_set_alpn_protos(ssl, kHttp2.data(), kHttp2.size());
    stream_.next_layer().expires_after(kPatience);
    stream_.next_layer().async_connect(found, [this](beast::error_code error, const tcp::endpoint&) {
      ended(Step::connecting, error);
      if (!error) shake_hands();
    });
    loop_.run();
    return diagnose();
  }

 private:
  enum class Step { connecting, shaking_hands, hearing };

  void ended(Step step, beast::error_code error) {
    step_ = step;
    error_ = error;
  }
  void shake_hands() {
    stream_.async_handshake(asio::ssl::stream_base::client, [this](beast::error_code error) {
      ended(Step::shaking_hands, error);
      // With TLS 1.3 a server verifies the client's certificate last: its first message shows the result.
      if (!error && speaks_http2()) {
        stream_.async_read_some(asio::buffer(heard_), [this](beast::error_code failed, std::size_t) {
          ended(Step::hearing, failed);
        });
      }
    });
  }

  bool speaks_http2() {
    const unsigned char* protocol = nullptr;
    unsigned length = 0;
    SSL_get0_alpn_selected(stream_.native_handle(), &protocol, &length);
    return length > 0;
  }

  Status diagnose() {
    if (error_ == beast::error::timeout) return unreachable("it doesn't answer", kIsItThere);
    if (step_ == Step::connecting && error_) return unreachable(error_.message(), kIsItThere);
    const SSL* const ssl = stream_.native_handle();
    if (const long verdict = SSL_get_verify_result(ssl); verdict != X509_V_OK) return distrusted(verdict);
    // gRPC closes the connection without a message if it rejects the certificate.
    const STACK_OF(X509_NAME)* const asked_of = SSL_get0_peer_CA_list(ssl);
    if (error_ && asked_of != nullptr && sk_X509_NAME_num(asked_of) > 0) return refused();
    if (step_ == Step::shaking_hands && error_)
      return wrong(fmt::format("what listens there speaks no TLS ({})", error_.message()),
                   "Give --daemon the address of its `listen`");
    if (!speaks_http2())
      return wrong("what listens there isn't the daemon's API",
                   "Give --daemon the address of its `listen`, not of `http_listen`");
    if (error_) return unreachable(error_.message(), "`journalctl -u emberlockd` may say why");
    return {};
  }

  [[nodiscard]] Status refused() const {
    if (shows_certificate_)
      return wrong(
          "the daemon refuses this client's certificate",
          "Give --tls-certificate one that the authority of its tls_clients signed, with its --tls-key");
    return wrong("the daemon wants a certificate of its clients",
                 "Give --tls-certificate and --tls-key, signed by the authority of its tls_clients");
  }
  [[nodiscard]] Status distrusted(long verdict) const {
    const std::string why = X509_verify_cert_error_string(verdict);
    if (verdict == X509_V_ERR_HOSTNAME_MISMATCH || verdict == X509_V_ERR_IP_ADDRESS_MISMATCH)
      return wrong("the daemon's certificate is for another name (" + why + ")",
                   "Give --daemon a name that the certificate has");
    if (verdict == X509_V_ERR_CERT_HAS_EXPIRED || verdict == X509_V_ERR_CERT_NOT_YET_VALID)
      return wrong("the daemon's certificate isn't valid now (" + why + ")",
                   "Renew it, or set this machine's clock");
    return wrong("--tls-ca doesn't vouch for the daemon's certificate (" + why + ")",
                 "Give it the certificate of who signed the daemon's");
  }
  [[nodiscard]] Error wrong(std::string what, std::string remedy) const {
    return {ErrorKind::bad_input, std::move(what), address_, std::move(remedy)};
  }
  [[nodiscard]] Error unreachable(const std::string& what, std::string remedy) const {
    return {ErrorKind::io, "the daemon can't be reached: " + what, address_, std::move(remedy)};
  }

  static constexpr const char* kIsItThere =
      "Is it running there, does its `listen` name this address, and does a firewall let it through?";

  std::string address_;
  bool shows_certificate_;
  beast::error_code error_;
  asio::io_context loop_;
  asio::ssl::context context_;
  beast::ssl_stream<beast::tcp_stream> stream_{loop_, context_};
  std::array<char, 1> heard_{};
  Step step_ = Step::connecting;
};

}  // namespace

Status check_tls(const std::string& address, const ClientTls& tls) {
  const auto to = split(address);
  if (!to)
    return Error{ErrorKind::bad_input, "is no address", address, "Give --daemon unix:PATH or HOST:PORT"};
  return Handshake(address, tls).run(*to);
}

}  // namespace emberlock::cli
