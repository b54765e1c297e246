// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "daemon/board.h"
#include "daemon/reconstruction/edit_queue.h"
#include "daemon/reconstruction/kept_frames.h"
#include "daemon/reconstruction/state.h"
#include "daemon/work/jobs.h"
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

/// Reconstructs recordings in child processes, and edits them there, one at a time, so that neither a GPU's
/// fault nor memory that runs out costs the daemon a frame. Each is a job, and so is a sequence of frames;
/// the child dies with the daemon. Thread-safe.
class ReconstructionChild {
 public:
  /// Every iteration goes to `board`, which must outlive the jobs, as this must.
  ReconstructionChild(ReconstructionOptions options, Board& board, Jobs& jobs)
      : options_(std::move(options)), board_(board), jobs_(jobs) {}
  ReconstructionChild(const ReconstructionChild&) = delete;
  ReconstructionChild& operator=(const ReconstructionChild&) = delete;

  /// Whether such a request could be started: no value is out of range, and the session has these frames.
  [[nodiscard]] Status check(const v1::ReconstructRequest& request) const;
  /// Errors: one runs already (`refused`), a session that isn't there or whose name is none, those of
  /// check().
  Result<v1::ReconstructionStatus> start(const v1::ReconstructRequest& request);
  /// SIGTERM, and SIGKILL after the grace; returns at once. `refused` when none runs.
  Result<v1::ReconstructionStatus> cancel();
  /// Hands a step to the stylization that runs, and waits until it is taken. Errors: EditQueue::ask()'s;
  /// `refused` where none runs, or its flame isn't reconstructed yet.
  Result<v1::StylizationStatus> edit(const v1::EditRequest& request);
  /// The stylization that runs writes its result; returns at once. Errors: `refused`, as of edit().
  Result<v1::ReconstructionStatus> finish();
  /// Kills the one that runs, and lets none begin any more; returns at once.
  void end();
  /// Of the one that runs, else of the last; nothing before the first.
  [[nodiscard]] std::optional<v1::ReconstructionStatus> status() const;
  /// A frame of the newest sequence, as it was kept. Null: it isn't done, or no longer held.
  [[nodiscard]] std::shared_ptr<const v1::IterationPreview> frame(const v1::FrameRequest& one) const;

 private:
  using TakeBytes = std::function<void(std::string_view)>;

  /// A sequence's frames; none of a request that isn't of one.
  [[nodiscard]] Result<std::vector<std::uint64_t>> frames_of(const v1::ReconstructRequest& request) const;
  [[nodiscard]] std::vector<std::string> command_for(const v1::ReconstructRequest& request) const;
  /// Of a stylization it is a new one, so that none overwrites another.
  [[nodiscard]] std::filesystem::path result_of(const v1::ReconstructRequest& request) const;
  [[nodiscard]] Status check_editable() const;
  Result<ChildProcess> spawn(const v1::ReconstructRequest& request);
  /// With mutex_ held.
  [[nodiscard]] bool runs() const { return running_ && !job_->result(); }
  JobResult supervise(v1::ReconstructRequest request, const Observer& observer);
  /// One child, from its start to its end.
  void reconstruct(const v1::ReconstructRequest& request, const Observer& observer);
  ChildEnd watch(ChildProcess& process, const TakeBytes& take_words, const Observer& observer);
  void take(v1::ChildMessage&& message);
  /// Tells the job's observer how far it is. False: it shall end.
  bool tell(const Observer& observer);

  const ReconstructionOptions options_;
  Board& board_;
  Jobs& jobs_;
  std::atomic<bool> ending_ = false;
  EditQueue edits_;

  mutable std::mutex mutex_;  ///< of what follows
  std::shared_ptr<JobHandle> job_;
  std::optional<SequenceState> state_;
  std::optional<v1::IterationPreview> newest_volume_;  ///< of the sequence's frame at hand
  KeptFrames kept_;
  std::int64_t begun_ns_ = 0;
  double seconds_ = 0;  ///< that the last one took
  bool running_ = false;
  bool stylizes_ = false;
  bool cancelling_ = false;
};

}  // namespace emberlock::daemon
