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

/// What one camera's writer has handed to the operating system, and what of it is on the disk. The writer
/// hands on and another thread syncs; neither waits for the other. Any thread may call anything.
class SyncLedger {
 public:
  /// fdatasync(2), or what a test puts in its place.
  using Flush = int (*)(int descriptor);

  /// `index` and `folders` (the innermost first) are synced too: the index after the segments, the folders
  /// whenever a file was begun.
  SyncLedger(UniqueFd index, std::filesystem::path index_path, std::vector<std::filesystem::path> folders,
             Flush flush = ::fdatasync);

  /// A segment was begun. The ledger keeps a descriptor of its own until its last frame is on the disk.
  Status begun(int segment, const std::filesystem::path& path);
  /// The frames up to `frames`, counted from the recording's first, are with the operating system: whole in
  /// their segment, and in the index.
  void handed(std::uint64_t frames);
  /// The segment begun last holds all that it ever will, and so do those before it.
  void ended();
  /// After a failure: of the frames only the first `frames` stay. Those of them that aren't safe are synced
  /// yet; a cut to what is safe forgets the error of a sync.
  void cut(std::uint64_t frames);

  /// Syncs what was handed on until now. An error stays, and nothing more becomes safe, until what isn't safe
  /// was cut off: the kernel tells of a write that failed once only (fsync(2)), so a second try proves
  /// nothing.
  Status sync();
  /// The error that sync() met, until it is cut off.
  [[nodiscard]] Status failure() const;

  [[nodiscard]] std::uint64_t handed() const;
  /// Frames that a power cut can't take any more.
  [[nodiscard]] std::uint64_t safe() const;
  /// Segments that are ended, but not on the disk yet.
  [[nodiscard]] std::size_t waiting() const;

 private:
  struct File {
    std::shared_ptr<UniqueFd> fd;
    std::filesystem::path path;
    bool ended = false;
    bool regular = true;  ///< else nothing of it, nor of what follows, ever is safe
  };
  struct Due {
    std::vector<File> segments;
    std::uint64_t frames = 0;
    bool folders = false;
  };
  /// `failed` is the segment whose error this is, if it is a segment's.
  Status sync(const Due& due, std::shared_ptr<UniqueFd>& failed) const;

  const Flush flush_;
  const UniqueFd index_;
  const std::filesystem::path index_path_;
  const std::vector<std::filesystem::path> folders_;

  std::mutex syncing_;        ///< one sync at a time
  mutable std::mutex mutex_;  ///< guards what follows
  Due due_{.segments = {}, .frames = 0, .folders = true};
  bool dirty_ = true;
  std::uint64_t safe_ = 0;
  std::uint64_t cuts_ = 0;  ///< a sync that began before a cut says nothing of the frames after it
  Status failure_;
};

}  // namespace emberlock::session
