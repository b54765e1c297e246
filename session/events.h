// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "base/unique_fd.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

// events.binpb: each Event in protobuf's wire format behind its length as a varint; append-only.

struct ParsedEvents {
  std::vector<v1::Event> events;
  std::size_t valid_bytes = 0;  ///< behind these the file is torn or foreign
};

/// The events up to the first that can't be read; any bytes are accepted.
ParsedEvents parse_events(std::string_view bytes);

/// The event as the file holds it.
std::string encode(const v1::Event& event);

/// The file, open for appending, locked against a second writer for as long as it lives.
class EventLog {
 public:
  enum class Mode { create, reopen };
  /// Error `refused` where another process holds the lock: the session is being recorded.
  static Result<EventLog> open(const std::filesystem::path& path, Mode mode);
  Status append(const v1::Event& event);
  /// Has the disk hold what was appended. An error stays: the kernel tells of a write that failed once only.
  /// Any thread.
  Status sync();

 private:
  struct Disk {
    std::mutex syncing;  ///< guards `failure`
    Status failure;
    std::atomic<bool> behind = true;  ///< events were appended since the last sync
  };
  EventLog(UniqueFd fd, std::filesystem::path path) : fd_(std::move(fd)), path_(std::move(path)) {}
  UniqueFd fd_;
  std::filesystem::path path_;
  std::unique_ptr<Disk> disk_ = std::make_unique<Disk>();
};

}  // namespace emberlock::session
