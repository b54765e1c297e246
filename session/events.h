// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include <sys/types.h>

#include "base/result.h"
#include "base/unique_fd.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

// events.binpb: each Event in protobuf's wire format, preceded by its length as a varint. Append-only.

struct ParsedEvents {
  std::vector<v1::Event> events;
  std::size_t valid_bytes = 0;  ///< the bytes after these are torn or foreign
};

/// Parses the events up to the first unreadable one. Accepts any bytes.
ParsedEvents parse_events(std::string_view bytes);

/// The event as it is stored in the file.
std::string encode(const v1::Event& event);

/// The file, open for appending. Locked against a second writer while this object exists.
class EventLog {
 public:
  enum class Mode { create, reopen };
  /// Error `refused` where another process holds the lock, because it is recording the session.
  static Result<EventLog> open(const std::filesystem::path& path, Mode mode);
  /// An event that the disk refuses is written again by the next call. One thread at a time.
  Status append(const v1::Event& event);
  /// Syncs what was appended to the disk. After an error the next call writes again what isn't synced,
  /// because the kernel reports a failed write only once. Any thread.
  Status sync();
  /// What the newest sync() returned. Any thread.
  [[nodiscard]] Status failure() const;

 private:
  struct Disk {
    std::mutex syncing;    ///< one sync at a time
    std::mutex mutex;      ///< guards the members below
    off_t synced = 0;      ///< bytes of the file
    std::string unsynced;  ///< behind them
    bool torn = false;     ///< the file may hold something else there
    bool behind = true;    ///< something was appended since the last sync
    Status failure;
  };
  Status write_again() const;  ///< requires the lock
  EventLog(UniqueFd fd, std::filesystem::path path) : fd_(std::move(fd)), path_(std::move(path)) {}
  UniqueFd fd_;
  std::filesystem::path path_;
  std::unique_ptr<Disk> disk_ = std::make_unique<Disk>();
};

/// Whether others may hold it too.
enum class Alone { no, yes };
/// A finished session, which nobody records or changes while this exists; nothing is held of one that has no
/// events. Errors: refused (another process writes it; its recording didn't end), bad_input (no session), io.
Result<UniqueFd> hold_finished(const std::filesystem::path& folder, Alone alone);

}  // namespace emberlock::session
