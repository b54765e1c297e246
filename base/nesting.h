// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Deeper than any file that we write or read, and far less than a recursive parser needs to exhaust a
/// thread's stack.
inline constexpr int kDeepestNesting = 64;

/// Limits the nesting of foreign JSON before it is parsed: at most `deepest` open brackets, those in strings
/// aside. Other syntax errors are left to the parser, which stops at the first one. Errors: bad_input with
/// the line.
Status check_json_nesting(std::string_view text, const std::string& where, int deepest = kDeepestNesting);

}  // namespace emberlock
