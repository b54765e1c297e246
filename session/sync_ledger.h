// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <vector>

#include <unistd.h>

#include "base/result.h"
#include "base/unique_fd.h"

namespace emberlock::session {

/// Tracks which of a camera's frames have been handed to the operating system and which are on the disk. The
/// writer hands frames on and another thread syncs; neither waits for the other. Thread-safe.
class SyncLedger {
 public:
  /// fdatasync(2), or its replacement in a test.
  using Flush = int (*)(int descriptor);

  /// `index` and `folders` (innermost first) are synced too: the index after the segments, the folders when a
  /// file was created.
  SyncLedger(UniqueFd index, std::filesystem::path index_path, std::vector<std::filesystem::path> folders,
             Flush flush = ::fdatasync);

  /// A segment was created. The ledger keeps its own descriptor until the segment's last frame is on the
  /// disk.
  Status begun(int segment, const std::filesystem::path& path);
  /// The first `frames` frames of the recording have been handed to the operating system, in segment and
  /// index.
  void handed(std::uint64_t frames);
  /// The last segment, and all before it, are complete.
  void ended();
  /// After a failure: keeps only the first `frames` frames. Those that aren't safe are still to be synced. A
  /// cut down to the safe frames clears the error of a sync.
  void cut(std::uint64_t frames);

  /// Syncs everything handed on so far. After an error nothing more becomes safe until the frames that aren't
  /// safe have been cut off: the kernel reports a failed write only once (fsync(2)), so a second sync proves
  /// nothing.
  Status sync();
  /// The error of sync(), until it is cleared by cut().
  [[nodiscard]] Status failure() const;

  [[nodiscard]] std::uint64_t handed() const;
  /// Number of frames that would survive a power cut.
  [[nodiscard]] std::uint64_t safe() const;
  /// Number of segments that are complete but not on the disk yet.
  [[nodiscard]] std::size_t waiting() const;

 private:
  struct File {
    std::shared_ptr<UniqueFd> fd;
    std::filesystem::path path;
    bool ended = false;
    bool regular = true;  ///< false (a pipe or device): this file and the following ones never count as safe
  };
  struct Due {
    std::vector<File> segments;
    std::uint64_t frames = 0;
    bool folders = false;
  };
  /// `failed` receives the segment that caused the error, if a segment did.
  Status sync(const Due& due, std::shared_ptr<UniqueFd>& failed) const;

  const Flush flush_;
  const UniqueFd index_;
  const std::filesystem::path index_path_;
  const std::vector<std::filesystem::path> folders_;

  std::mutex syncing_;        ///< one sync at a time
  mutable std::mutex mutex_;  ///< guards the members below
  Due due_{.segments = {}, .frames = 0, .folders = true};
  bool dirty_ = true;
  std::uint64_t safe_ = 0;
  std::uint64_t cuts_ = 0;  ///< a sync that began before a cut proves nothing about later frames
  Status failure_;
};

}  // namespace emberlock::session
