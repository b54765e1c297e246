// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "rig/access.h"

namespace emberlock::cli {

/// A client's trusted authority and its own identity, as PEM.
struct ClientTls {
  std::string ca;               ///< authority that signed the daemon's certificate
  rig::TlsIdentity identity{};  ///< empty: none is sent
};

/// Makes a TLS handshake with the daemon at HOST:PORT and disconnects. Its errors are clearer than gRPC's and
/// say which side rejected which certificate, and why: bad_input for a wrong option, io where nobody answers
/// in time.
Status check_tls(const std::string& address, const ClientTls& tls);

}  // namespace emberlock::cli
