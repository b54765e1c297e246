// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/server/auth_failures.h"

namespace emberlock::daemon {

enum class TokenField { none, shown };

/// What a browser is shown that isn't let in: what to do, without scripts; and where there is a token, a form
/// for it, which POSTs token=... to /open.
std::string stranger_page(Refusal refusal, TokenField field);
/// The Content-Security-Policy that it goes with.
inline constexpr const char* kStrangerPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'; base-uri 'none'; frame-ancestors "
    "'none'";

}  // namespace emberlock::daemon
