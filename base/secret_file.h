// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Whether a file with a secret is private. Error bad_input: users other than its owner and group can read
/// it, or users other than its owner can write to it; `what` names the secret: "the token".
Status check_secret_file(const std::filesystem::path& file, std::string_view what);

/// Reads a file with a secret. Errors: as read_file(), and as check_secret_file().
Result<std::string> read_secret_file(const std::filesystem::path& file, std::size_t max_bytes,
                                     std::string_view what);

}  // namespace emberlock
