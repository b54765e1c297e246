// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/http_stream.h"

#include <boost/asio/buffer.hpp>
#include <openssl/ssl.h>

namespace emberlock::daemon {

namespace asio = boost::asio;

Result<std::shared_ptr<asio::ssl::context>> make_tls_context(const rig::ServerTls& tls) {
  auto context = std::make_shared<asio::ssl::context>(asio::ssl::context::tls_server);
  SSL_CTX* const native = context->native_handle();
  SSL_CTX_set_min_proto_version(native, TLS1_2_VERSION);
  boost::system::error_code error;
  context->use_certificate_chain(asio::buffer(tls.identity.certificate), error);
  if (!error) context->use_private_key(asio::buffer(tls.identity.key), asio::ssl::context::pem, error);
  if (!error && !tls.clients.empty()) {
    context->add_certificate_authority(asio::buffer(tls.clients), error);
    context->set_verify_mode(asio::ssl::verify_peer | asio::ssl::verify_fail_if_no_peer_cert);
    // Required: otherwise OpenSSL doesn't resume sessions of clients with certificates.
    constexpr unsigned char kName[] = "emberlock";
    SSL_CTX_set_session_id_context(native, kName, sizeof kName);
  }
  if (error)
    return Error{ErrorKind::bad_input, error.message(), "TLS", "give another certificate, with its key"};
  return context;
}

}  // namespace emberlock::daemon
