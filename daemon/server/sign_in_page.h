// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "daemon/server/auth_failures.h"

namespace emberlock::daemon {

enum class TokenField { none, shown };

/// The page for a browser that isn't let in: says what to do, without scripts. If there is a token, it has a
/// form for it, which POSTs token=... to /open.
std::string sign_in_page(Refusal refusal, TokenField field);
/// The page's Content-Security-Policy.
inline constexpr const char* kSignInPolicy =
    "default-src 'none'; style-src 'unsafe-inline'; form-action 'self'; base-uri 'none'; frame-ancestors "
    "'none'";

}  // namespace emberlock::daemon
