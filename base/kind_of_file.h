// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock {

/// Opens a regular file to read. Anything else, such as a named pipe, which would block, is refused before it
/// is opened. Errors (bad_input): no such file, not a regular one.
Result<UniqueFd> open_regular_file(const std::filesystem::path& path);
/// The same for readers that open files by their paths: only looks whether it is a regular file.
Status check_regular_file(const std::filesystem::path& path);

/// The file's extension in small letters, as cameras and Windows write capital ones: ".json" of "RIG.JSON".
std::string lower_extension(const std::filesystem::path& path);

}  // namespace emberlock
