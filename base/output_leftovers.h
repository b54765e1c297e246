// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock {

// Names of the folders that a run makes beside its target, and the cleanup of what killed runs left.

/// The prefix of the names of all hidden folders in which results for `target` are filled.
std::string hidden_prefix(const std::filesystem::path& target);
/// The temporary name of the earlier result on file systems that can't exchange two folders.
std::filesystem::path earlier_of(const std::filesystem::path& target);

/// Whether anything of this name exists; symlinks aren't followed.
bool is_there(const std::filesystem::path& path);

/// An error of kind io with errno's text.
Error refused_by_system(const std::filesystem::path& path, const std::string& action,
                        std::string remedy = "Check the disk's space and the folder's permissions");

/// Locks a folder against other processes that replace results or clean up in it, until the descriptor is
/// closed. Waits up to `patience`, and reports that it waits. Errors: io.
Result<UniqueFd> lock_folder(const std::filesystem::path& folder, Seconds patience = Seconds(120));

/// Locks the list in a folder. While the lock is held, the folder counts as being filled. Empty if another
/// process holds it.
UniqueFd lock_list(const std::filesystem::path& folder);

/// Removes the rest of a folder that `target` has replaced: the files of its own list, and hard links of
/// files that `target` holds too. The list is removed last, so a killed cleanup can be continued. Returns
/// whether everything is gone.
bool discard(const std::filesystem::path& folder, const std::filesystem::path& target);

/// Cleans up what killed runs left beside `target`. The parent folder must be locked. Errors: bad_input where
/// something else has the name earlier_of(target).
Status clean_up(const std::filesystem::path& target);

}  // namespace emberlock
