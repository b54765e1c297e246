#pragma once

#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Whatever the locale.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Whether `name` may name a camera's folder: letters, digits, space and . _ : - alone, no point in
/// front, 1..200 bytes; so it can't lead out of the folder that it stands in.
bool is_folder_name(std::string_view name);

/// Whether `name` may name a session: as is_folder_name, no space or point at its end, and none of the names
/// that Windows keeps for devices ("con", "nul.txt", ...), as recordings are copied there. Error bad_input
/// says what is wrong. Whatever takes a session's name from outside asks here first.
Status check_session_name(std::string_view name);

}  // namespace emberlock
