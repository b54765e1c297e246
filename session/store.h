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
  std::uint64_t min_free_bytes = WriterOptions{}.min_free_bytes;  ///< the floor: below it frames are refused
};

/// The folder in which sessions lie, a folder each. Any thread may call anything.
class SessionStore {
 public:
  /// Creates the folder where there is none. Error io: it can't be written.
  static Result<SessionStore> open(std::filesystem::path folder, StoreOptions options = {});

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }
  /// The newest first. One that can't be read is there too, with the reason.
  [[nodiscard]] v1::ListSessionsResponse list() const;
  /// The folder of a session that is there. Error bad_input: a name that can't be one, or no such session.
  [[nodiscard]] Result<std::filesystem::path> path_of(std::string_view name) const;
  /// The folder for a new session, not yet made. An empty name becomes the time, "2026-11-22 03-15-09", with
  /// a number behind it where that is taken. Error bad_input: the name can't be one, or is taken.
  [[nodiscard]] Result<std::filesystem::path> path_for_new(std::string_view name, TimePoint wall_clock) const;
  /// Where a session's export goes: beside the sessions' folder, exports/NAME/WHAT. Error bad_input: a name
  /// that can't be one, or a symbolic link on the way there, which may lead anywhere.
  [[nodiscard]] Result<std::filesystem::path> path_for_export(std::string_view name,
                                                              std::string_view what) const;
  /// Free space, and how long it lasts at this rate, e.g. bytes_per_second of all cameras.
  [[nodiscard]] Result<v1::StorageStatus> storage(double bytes_per_s) const;
  /// The folders of sessions that say that they are being recorded: by another process, or by one that was
  /// killed. Fast, as it comes before the daemon is ready.
  [[nodiscard]] std::vector<std::filesystem::path> unfinished() const;
  /// Of those that are finished.
  [[nodiscard]] std::vector<std::filesystem::path> finished() const;

 private:
  SessionStore(std::filesystem::path folder, StoreOptions options)
      : folder_(std::move(folder)), options_(options) {}
  std::filesystem::path folder_;
  StoreOptions options_;
};

}  // namespace emberlock::session
