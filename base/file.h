// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// Reads a whole file. Refuses files above `max_bytes`. The error names the file.
Result<std::string> read_file(const std::filesystem::path& path,
                              std::size_t max_bytes = std::size_t{1} << 30);

/// Flushes a folder's entries to the disk. Without it, a power cut may undo files created, renamed or removed
/// in it.
Status sync_folder(const std::filesystem::path& folder);

/// Writes to a file beside the target, flushes it to the disk, then renames it. A reader sees either the old
/// or the new content, never a part; also after a power cut.
Status write_file_atomically(const std::filesystem::path& path, std::string_view content);

}  // namespace emberlock
