// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string_view>

#include "base/result.h"

namespace emberlock::session {

/// Whatever the locale.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Whether `name` may name a camera's folder: letters, digits, space and . _ : - alone, no point in
/// front, 1..200 bytes; so it can't lead out of the folder that it stands in.
bool is_folder_name(std::string_view name);

/// Whether `name` may name a session: as is_folder_name, no space or hyphen in front, which shells and
/// programs take for something else, no space or point at its end, and none of the names that Windows keeps
/// for devices ("con", "nul.txt", ...), as recordings are copied there. Error bad_input says what is wrong.
/// Whatever takes a session's name from outside asks here first.
Status check_session_name(std::string_view name);

/// The most bytes that a field of free text may have.
inline constexpr std::size_t kMaxTextBytes = 1000;

/// Whether free text that somebody gives, or that a manifest holds, may stand in the field `field`: at most
/// kMaxTextBytes, and no control characters; that it is UTF-8 protobuf sees to. Error bad_input names the
/// field.
Status check_text(std::string_view field, std::string_view text);

}  // namespace emberlock::session
