// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace emberlock {

/// Escapes text for roff, the language of manual pages.
std::string roff(std::string_view text);

}  // namespace emberlock
