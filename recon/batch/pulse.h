// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "base/clock.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "recon/batch/ledger.h"

namespace emberlock::recon {

/// A process of a machine, told from all that had its number before.
struct Worker {
  std::string host;
  std::string boot;  ///< the kernel's boot id and its PID namespace: where pid and started are of one count
  std::int64_t pid = 0;
  std::uint64_t started = 0;  ///< clock ticks since boot (proc(5), stat's field 22)
  int rank = 0;
  std::string device = {};  ///< what it computes on

  /// The calling process.
  static Worker here(int rank, std::string device);
  /// "HOST-PID-STARTED": a file's name.
  [[nodiscard]] std::string name() const;
};
std::string to_json(const Worker& worker);
Result<Worker> parse_worker(std::string_view json, const std::string& where);

/// Whether this machine runs it, as far as this process can tell: nothing of another machine's, or of one
/// whose processes it doesn't see.
std::optional<bool> runs_here(const Worker& worker);

/// WORKERS/NAME says who a worker is, and is touched every so often while it lives: by a thread of its own,
/// so that long steps don't matter. Others are alive as long as the time of their file changes while one
/// looks on: nobody's clock is compared with another's. Those of this machine are asked the kernel for.
class Pulse {
 public:
  /// The clock must outlive the pulse. Error: io.
  static Result<std::unique_ptr<Pulse>> start(const std::filesystem::path& workers, const Worker& me,
                                              Seconds patience, const Clock& clock);
  /// Takes the worker's file away: it has gone in peace.
  ~Pulse();
  Pulse(const Pulse&) = delete;
  Pulse& operator=(const Pulse&) = delete;

  /// Silent: its file stayed as it is for longer than the patience, since it was asked for first.
  [[nodiscard]] Life life_of(const std::string& worker);

 private:
  struct Seen {
    Worker worker;
    std::int64_t changed = 0;  ///< the file's time, ns, of whatever clock
    TimePoint at;              ///< by this machine's clock, when that was first seen
  };
  Pulse(std::filesystem::path workers, const Worker& me, Seconds patience, const Clock& clock);
  void beat();

  std::filesystem::path workers_, mine_;
  Seconds patience_;
  const Clock& clock_;
  std::map<std::string, Seen> seen_;
  std::mutex mutex_;
  std::condition_variable ending_;
  bool ended_ = false;  // guarded by mutex_
  std::thread thread_;
};

/// The workers whose files are there.
std::map<std::string, Worker> workers_in(const std::filesystem::path& workers);

}  // namespace emberlock::recon
