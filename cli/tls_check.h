// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "rig/access.h"

namespace emberlock::cli {

/// What a client believes and shows, as PEM.
struct ClientTls {
  std::string ca;               ///< who vouches for the daemon
  rig::TlsIdentity identity{};  ///< empty: none is shown
};

/// Shakes hands with the daemon at HOST:PORT, and hangs up. Errors are clearer than gRPC's, and say which
/// side refused which certificate and why: bad_input where an option is wrong, io where nobody answers in
/// time.
Status check_tls(const std::string& address, const ClientTls& tls);

}  // namespace emberlock::cli
