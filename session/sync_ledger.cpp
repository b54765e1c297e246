// SPDX-License-Identifier: Apache-2.0
#include "session/sync_ledger.h"

#include <algorithm>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "base/file.h"
#include "session/files.h"

namespace emberlock::session {

SyncLedger::SyncLedger(UniqueFd index, std::filesystem::path index_path,
                       std::vector<std::filesystem::path> folders, Flush flush)
    : flush_(flush),
      index_(std::move(index)),
      index_path_(std::move(index_path)),
      folders_(std::move(folders)) {}

Status SyncLedger::begun(int segment, const std::filesystem::path& path) {
  auto fd = std::make_shared<UniqueFd>(::fcntl(segment, F_DUPFD_CLOEXEC, 0));
  struct stat info {};
  if (!*fd || ::fstat(fd->get(), &info) != 0) return errno_error(path, "cannot keep the segment open");
  const std::scoped_lock lock(mutex_);
  due_.segments.push_back({std::move(fd), path, false, S_ISREG(info.st_mode)});
  due_.folders = true;
  dirty_ = true;
  return {};
}

void SyncLedger::handed(std::uint64_t frames) {
  const std::scoped_lock lock(mutex_);
  dirty_ |= due_.frames != frames;
  due_.frames = frames;
}

void SyncLedger::ended() {
  const std::scoped_lock lock(mutex_);
  for (File& segment : due_.segments) segment.ended = true;
  dirty_ = true;
}

void SyncLedger::cut(std::uint64_t frames) {
  const std::scoped_lock lock(mutex_);
  ++cuts_;
  if (frames <= safe_) {
    due_.segments.clear();
    failure_ = {};
  } else {
    for (File& segment : due_.segments) segment.ended = true;
  }
  due_.frames = frames;
  safe_ = std::min(safe_, frames);
  dirty_ = true;
}

/// Syncs data before the index. Of frames written during the sync, the index may reach the disk without the
/// data; that is why salvage checks the last segments.
Status SyncLedger::sync(const Due& due, std::shared_ptr<UniqueFd>& failed) const {
  for (const File& segment : due.segments) {
    if (!segment.regular || flush_(segment.fd->get()) == 0) continue;
    failed = segment.fd;
    return errno_error(segment.path, "cannot flush");
  }
  if (due.folders) {
    for (const std::filesystem::path& folder : folders_) EMBERLOCK_RETURN_IF_ERROR(sync_folder(folder));
  }
  if (flush_(index_.get()) != 0) return errno_error(index_path_, "cannot flush");
  return {};
}

Status SyncLedger::sync() {
  const std::scoped_lock one_at_a_time(syncing_);
  Due due;
  std::uint64_t cuts = 0;
  {
    const std::scoped_lock lock(mutex_);
    if (!failure_) return failure_;
    if (!dirty_) return {};
    due = due_;
    cuts = cuts_;
    dirty_ = false;
    due_.folders = false;
  }
  // A stream's write-back was started when it was written (SegmentWriter); this waits for the rest.
  std::shared_ptr<UniqueFd> failed;
  Status done = sync(due, failed);
  const std::scoped_lock lock(mutex_);
  if (!done) {
    // The failed segment may have been cut off meanwhile.
    const bool cut_off = failed != nullptr && cuts != cuts_ &&
                         std::none_of(due_.segments.begin(), due_.segments.end(),
                                      [&](const File& file) { return file.fd == failed; });
    if (!cut_off) failure_ = done;
    due_.folders = true;
    dirty_ = true;
    return cut_off ? Status{} : done;
  }
  const bool all_regular =
      std::all_of(due.segments.begin(), due.segments.end(), [](const File& f) { return f.regular; });
  if (cuts != cuts_ || !all_regular) return {};
  safe_ = std::max(safe_, due.frames);
  // Segments that ended before this sync began are done.
  const auto is_done = [&](const File& file) {
    return std::any_of(due.segments.begin(), due.segments.end(),
                       [&](const File& synced) { return synced.ended && synced.fd == file.fd; });
  };
  std::erase_if(due_.segments, is_done);
  return {};
}

Status SyncLedger::failure() const {
  const std::scoped_lock lock(mutex_);
  return failure_;
}

std::uint64_t SyncLedger::handed() const {
  const std::scoped_lock lock(mutex_);
  return due_.frames;
}

std::uint64_t SyncLedger::safe() const {
  const std::scoped_lock lock(mutex_);
  return safe_;
}

std::size_t SyncLedger::waiting() const {
  const std::scoped_lock lock(mutex_);
  return static_cast<std::size_t>(
      std::count_if(due_.segments.begin(), due_.segments.end(), [](const File& f) { return f.ended; }));
}

}  // namespace emberlock::session
