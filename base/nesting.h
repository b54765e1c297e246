// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Deeper than any file that we write or read, and far less than a recursive parser needs to exhaust a
/// thread's stack.
inline constexpr int kDeepestNesting = 64;

/// Refuses foreign JSON before it is parsed for what parsers explain badly: more than `deepest` open brackets
/// (those in strings aside), UTF-16, and a comma before a closing bracket. Other syntax errors are left to
/// the parser, which stops at the first one. Errors: bad_input with the line.
Status check_json_nesting(std::string_view text, const std::string& where, int deepest = kDeepestNesting);

/// Whether JSON ends within a string or between brackets, so that its end is missing.
bool ends_too_early(std::string_view text);

/// The JSON with null for each NaN, Infinity and -Infinity outside of strings, which Python writes, so that a
/// parser can name the field.
std::string with_null_for_nan(std::string_view text);

}  // namespace emberlock
