// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/time_point.h"
#include "emberlock/v1/services.pb.h"
#include "emberlock/v1/status.pb.h"
#include "session/writer.h"

namespace emberlock::session {

struct StoreOptions {
  std::uint64_t min_free_bytes =
      WriterOptions{}.min_free_bytes;  ///< below this much free space frames are refused
};

/// Bytes of all files below `folder` whose size can be read.
std::uint64_t bytes_below(const std::filesystem::path& folder);

/// The folders of all sessions in a folder, finished or not, by name. Other entries are ignored.
std::vector<std::filesystem::path> sessions_in(const std::filesystem::path& folder);

/// A file system, as the kernel identifies it: by its own id, and where it has none by its device.
struct DiskId {
  std::uint64_t file_system = 0;  ///< 0: it has no id (NFS, FUSE)
  std::uint64_t device = 0;
  friend bool operator==(const DiskId& a, const DiskId& b) {
    if (a.file_system != 0 && b.file_system != 0) return a.file_system == b.file_system;
    return a.device == b.device;
  }
};

/// The folder that holds all sessions, one folder each. Thread-safe. It stays on the disk on which it was
/// opened: when that isn't mounted any more, nothing is stored on the one below the mount point.
class SessionStore {
 public:
  /// Creates the folder if it is missing. Error io: it can't be written.
  static Result<SessionStore> open(std::filesystem::path folder, StoreOptions options = {});

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// Error refused: the folder lies on another disk than when it was opened.
  [[nodiscard]] Status check_disk() const;
  /// Newest first. Unreadable sessions are listed too, with the reason.
  [[nodiscard]] v1::ListSessionsResponse list() const;
  /// The folder of an existing session. Error bad_input: an invalid name, or no such session.
  [[nodiscard]] Result<std::filesystem::path> path_of(std::string_view name) const;
  /// The folder for a new session; it isn't created. An empty name becomes the time, "2026-11-22 03-15-09",
  /// with a number behind it if that is taken. Errors: bad_input (the name is invalid or taken), those of
  /// check_disk().
  [[nodiscard]] Result<std::filesystem::path> path_for_new(std::string_view name, TimePoint wall_clock) const;
  /// The folder for a session's export, beside the sessions' folder: exports/NAME/WHAT. Error bad_input: an
  /// invalid name, or a symbolic link in the path, which could lead anywhere; those of check_disk().
  [[nodiscard]] Result<std::filesystem::path> path_for_export(std::string_view name,
                                                              std::string_view what) const;
  /// Free space, and how long it lasts at this rate (e.g. bytes_per_second of all cameras). Errors: io, those
  /// of check_disk().
  [[nodiscard]] Result<v1::StorageStatus> storage(double bytes_per_s) const;
  /// Folders of sessions in state RECORDING: recorded by another process, or left by one that was killed.
  /// Fast, because the daemon runs it at start-up.
  [[nodiscard]] std::vector<std::filesystem::path> unfinished() const;
  /// Folders of finished sessions.
  [[nodiscard]] std::vector<std::filesystem::path> finished() const;

 private:
  SessionStore(std::filesystem::path folder, StoreOptions options, DiskId disk)
      : folder_(std::move(folder)), options_(options), disk_(disk) {}
  std::filesystem::path folder_;
  StoreOptions options_;
  DiskId disk_;  ///< on which it was opened
};

}  // namespace emberlock::session
