// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "base/quantity.h"
#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock {

// What runs put beside their targets, and how what killed runs left is put right.

/// The beginning of the name of every folder that `target` was ever filled in.
std::string hidden_prefix(const std::filesystem::path& target);
/// What the earlier result is called for a moment where the file system can't exchange two folders.
std::filesystem::path earlier_of(const std::filesystem::path& target);

/// Something of this name; what a symlink leads to doesn't matter.
bool is_there(const std::filesystem::path& path);

/// Of kind io, with what errno says.
Error refused_by_system(const std::filesystem::path& path, const std::string& action,
                        std::string remedy = "Check the disk's space and the folder's permissions");

/// Holds off all others who replace, or clean up, in one folder, until it is closed. Waits for them while
/// patience lasts, and says so. Errors: io.
Result<UniqueFd> lock_folder(const std::filesystem::path& folder, Seconds patience = Seconds(120));

/// Locks the list in a folder, if nobody else has: as long as it is held the folder is being filled. Empty
/// otherwise.
UniqueFd lock_list(const std::filesystem::path& folder);

/// Removes what is left of a folder that `target` has taken the place of: the files of its own list, and
/// those that `target` holds too (hard links of the same). The list goes last, so that who is killed here
/// leaves a folder that can be known. Returns whether nothing is left.
bool discard(const std::filesystem::path& folder, const std::filesystem::path& target);

/// Puts right what runs left that were killed; its parent is locked. Errors: bad_input where something else
/// has the name of earlier_of(target).
Status clean_up(const std::filesystem::path& target);

}  // namespace emberlock
