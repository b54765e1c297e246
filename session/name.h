// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock::session {

/// Independent of the locale.
constexpr bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Whether `name` can be a camera's folder: only letters, digits, space and . _ : -, no leading point, 1..200
/// bytes. Such a name can't lead out of its parent folder.
bool is_folder_name(std::string_view name);

/// Whether `name` can name a session: letters of any script, in UTF-8, and of ASCII only what is_folder_name
/// allows; 1..200 bytes, as the disk counts them. Refused are what leads elsewhere or can't be seen (control
/// characters, invisible ones, those that turn the direction of writing, spaces other than the plain one,
/// what looks like a slash); a point in front; a leading space or hyphen, which shells and programs misread;
/// a trailing space or point, and device names of Windows ("con", "nul.txt", ...), because recordings are
/// copied there. Error bad_input says what is wrong. All code that takes a session's name from outside checks
/// it here first.
Status check_session_name(std::string_view name);

/// The name under which a new session is stored: composed() (text.h), so that what looks the same is the
/// same. `name` must have passed the check.
std::string stored_name(std::string_view name);

/// Maximum length of a free text field in bytes.
inline constexpr std::size_t kMaxTextBytes = 1000;

/// Whether free text, given by a user or in a manifest, is valid for the field `field`: at most
/// kMaxTextBytes, no control characters (protobuf checks UTF-8). Error bad_input names the field.
Status check_text(std::string_view field, std::string_view text);

}  // namespace emberlock::session
