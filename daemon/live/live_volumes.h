// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "daemon/board.h"
#include "daemon/live/state.h"
#include "daemon/live/yield.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::daemon {

class ChildProcess;

struct LiveOptions {
  std::filesystem::path program;  ///< `PROGRAM reconstruct-live`: emberlock, beside the daemon
  std::string device = {};        ///< as of `emberlock reconstruct`; empty: auto
  int threads = 0;                ///< on the CPU; 0: every core
  Seconds silence{600};           ///< a child that tells nothing for so long, while it may work, hangs
};

/// Whether every number of the request is in its range: bad_input otherwise.
Status check_live(const v1::LiveRequest& request);

/// Volumes of a recording's newest frames, while it goes on, by a child process that reads the session's
/// files behind the writer and has what nobody else wants of the machine (`emberlock reconstruct-live`). The
/// recording never waits for it: it is stopped by a signal where that has trouble (LiveYield). Thread-safe.
class LiveVolumes {
 public:
  /// `board` outlives it.
  LiveVolumes(LiveOptions options, Board& board);
  LiveVolumes(const LiveVolumes&) = delete;
  LiveVolumes& operator=(const LiveVolumes&) = delete;
  ~LiveVolumes();

  /// Of a session whose recording has begun; returns at once. What fails the status tells.
  void start(const std::filesystem::path& session, const v1::LiveRequest& request);
  /// So many frames of each camera are on the disk, and how the recording gets on. Returns at once.
  void offer(std::vector<std::uint64_t> safe, const RecordingLoad& load);
  /// The recording ends: kills the child; returns at once.
  void stop();
  [[nodiscard]] bool runs() const;
  /// Of the recording at hand, else of the last that had them; nothing before the first.
  [[nodiscard]] std::optional<v1::LiveStatus> status() const;

 private:
  struct Offered {
    std::vector<std::uint64_t> safe;
    RecordingLoad load;
  };
  void run(const v1::LiveInput& session);
  ChildEnd watch(ChildProcess& child, const v1::LiveInput& session, std::string& last_words);
  /// What comes of the newest offer: bytes for the child, if it is to get any and has read the last ones.
  std::string take_offer(const ChildProcess& child, LiveYield& yield, bool idle);
  void take(v1::ChildMessage&& message);
  void wake() const;
  void tell_end(const ChildEnd& end, const std::string& last_words);

  const LiveOptions options_;
  Board& board_;
  const UniqueFd woken_;  ///< an eventfd
  std::thread thread_;
  std::atomic<bool> ending_ = false;

  mutable std::mutex mutex_;  ///< of what follows
  std::optional<LiveState> state_;
  std::optional<Offered> offered_;
  bool runs_ = false;
};

}  // namespace emberlock::daemon
