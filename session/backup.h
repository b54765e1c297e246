// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/progress.h"
#include "base/result.h"

// Copies of finished sessions in a folder of backups, such as one on another disk.
namespace emberlock::session {

struct Backup {
  enum class Outcome {
    copied,   ///< there was no copy
    renewed,  ///< the copy was another one: it has been replaced
    kept,     ///< the copy is the session
  };
  Outcome outcome = Outcome::kept;
  std::uint64_t files = 0;
  std::uint64_t bytes = 0;
};

/// How a session and its copy are compared.
enum class Compare {
  times,  ///< by names, sizes and times of modification
  bytes,  ///< all is read
};

/// Copies a session to `backups`/NAME, under the name of its folder. The copy appears once it is whole, on
/// the disk, and read back; if interrupted, the next call goes on. A copy that differs from the session is
/// replaced only if it is this session's, each frame of the session can be read, and it has no fewer of them:
/// else the copy may be the better one. The session can't be recorded or changed by another process
/// meanwhile. Errors: bad_input (no session; it holds something other than files and folders), refused (it
/// isn't finished; another process writes it; the copy that is there may be the better one, or is another
/// session's; cancelled by the observer), io.
Result<Backup> back_up_session(const std::filesystem::path& folder, const std::filesystem::path& backups,
                               Compare compare, const Observer& observer = {});

/// Whether `copy` holds the session's files, no more and no less. Errors: bad_input (the first difference);
/// refused (a file of the copy is the session's own, by a mount or a hard link).
Status compare_copy(const std::filesystem::path& folder, const std::filesystem::path& copy, Compare compare,
                    const Observer& observer = {});

/// Removes a session whose copy in `backups` is the same, byte for byte. It is gone at once, or untouched.
/// Errors: as back_up_session; bad_input where the copy differs or isn't there.
Status remove_backed_up(const std::filesystem::path& folder, const std::filesystem::path& backups,
                        const Observer& observer = {});

/// Removes what a remove_backed_up() that was killed left in the sessions' folder.
void finish_removals(const std::filesystem::path& sessions);

}  // namespace emberlock::session
