// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "base/result.h"

namespace emberlock {

/// The whole file; an Error that names it otherwise. Refuses files above `max_bytes`.
Result<std::string> read_file(const std::filesystem::path& path,
                              std::size_t max_bytes = std::size_t{1} << 30);

/// Has the disk hold what was created, renamed or removed in `folder`: without it a power cut may undo that.
Status sync_folder(const std::filesystem::path& folder);

/// Writes beside the target, flushes to disk, then renames: a reader sees the old content or the new, never
/// half, and after a power cut too.
Status write_file_atomically(const std::filesystem::path& path, std::string_view content);

}  // namespace emberlock
