// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Deeper than any file of ours, or that we read, and far from what a thread's stack holds of a parser that
/// calls itself.
inline constexpr int kDeepestNesting = 64;

/// Before foreign JSON is parsed: brackets outside strings, at most `deepest` in each other. What isn't JSON
/// is the parser's to refuse, which reads no further than its first fault. Errors: bad_input with the line.
Status check_json_nesting(std::string_view text, const std::string& where, int deepest = kDeepestNesting);

}  // namespace emberlock
