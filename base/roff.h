// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace emberlock {

/// Text as roff shows it, the language of manual pages: what it would take for its own is escaped.
std::string roff(std::string_view text);

}  // namespace emberlock
