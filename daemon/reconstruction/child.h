// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/unique_fd.h"
#include "daemon/board.h"
#include "daemon/reconstruction/state.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::daemon {

class ChildProcess;

struct ReconstructionOptions {
  std::filesystem::path program;   ///< `PROGRAM reconstruct ...`: emberlock, beside the daemon
  std::filesystem::path sessions;  ///< the folder of recordings
  std::filesystem::path results;   ///< RESULTS/SESSION/frame-N, or middle-frame
  v1::ReconstructRequest
      unasked;           ///< budget, voxels, views held out and device, where a request leaves them open
  int threads = 0;       ///< on the CPU, 0..256; 0: every core
  Seconds silence{600};  ///< a child that tells nothing for so long hangs, > 0
  Seconds grace{3};      ///< from SIGTERM to SIGKILL, >= 0
  int niceness = 10;     ///< 0..19: frames go first
};

/// Reconstructs recordings in a child process, one at a time, so that neither a GPU's fault nor memory that
/// runs out costs the daemon a frame. The child dies with the daemon. Thread-safe.
class ReconstructionChild {
 public:
  /// Every iteration goes to `board`, which must outlive this. `changed` is called after each change of
  /// status(), from a thread of this class: it must return at once.
  ReconstructionChild(ReconstructionOptions options, Board& board, std::function<void()> changed = {});
  /// Kills what still runs.
  ~ReconstructionChild();
  ReconstructionChild(const ReconstructionChild&) = delete;
  ReconstructionChild& operator=(const ReconstructionChild&) = delete;

  /// Errors: one runs already (`refused`), a session that isn't there or whose name is none, values out of
  /// range.
  Result<v1::ReconstructionStatus> start(const v1::ReconstructRequest& request);
  /// SIGTERM, and SIGKILL after the grace; returns at once. `refused` when none runs.
  Result<v1::ReconstructionStatus> cancel();
  /// Of the one that runs, else of the last; nothing before the first.
  [[nodiscard]] std::optional<v1::ReconstructionStatus> status() const;

 private:
  enum class Asked { nothing, cancel, kill };
  using TakeBytes = std::function<void(std::string_view)>;

  void supervise(const std::vector<std::string>& command);
  ChildEnd watch(ChildProcess& process, const TakeBytes& take_words);
  void take(v1::ChildMessage&& message);

  const ReconstructionOptions options_;
  Board& board_;
  const std::function<void()> changed_;
  UniqueFd wake_;  ///< an eventfd: something was asked

  std::mutex starting_;  ///< one start() at a time
  std::thread thread_;
  mutable std::mutex mutex_;  ///< of what follows
  std::optional<ReconstructionState> state_;
  std::int64_t begun_ns_ = 0;
  double seconds_ = 0;  ///< that the last one took
  bool running_ = false;
  Asked asked_ = Asked::nothing;
};

}  // namespace emberlock::daemon
