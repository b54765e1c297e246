// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "daemon/work/job.h"
#include "daemon/work/workers.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

struct JobLimits {
  std::size_t asked = 2;    ///< concurrent jobs that clients asked for
  std::size_t waiting = 8;  ///< more of them that wait
};

/// All jobs of the daemon, on three groups of threads:
///   at once     the end of a recording and a reconstruction (at most one of each)
///   as asked    verification, repair and export: a few at a time, at the lowest priority
///   background  salvage and compression: one after another, at the lowest priority, paused during recordings
/// A job may use more threads (base/in_parallel.h), which have its priority. Thread-safe.
class Jobs {
 public:
  explicit Jobs(JobLimits limits = {});
  Jobs(const Jobs&) = delete;
  Jobs& operator=(const Jobs&) = delete;
  ~Jobs();  ///< end(), and waits for those that run

  /// Cancels all jobs but the end of a recording, and refuses every other from now on.
  void end();
  /// A second background job of the same kind and session isn't added: the first one's handle is returned.
  /// Error `refused`: too many jobs are waiting, or the daemon is shutting down.
  Result<std::shared_ptr<JobHandle>> add(Job job);
  /// Error `refused`: there is no job with this id, or it can't be cancelled.
  Status cancel(std::uint64_t id);
  /// Background jobs pause at their next report of progress, until resume().
  void pause();
  void resume();
  /// The jobs that run, wait or are paused, in the order in which they were added.
  [[nodiscard]] std::vector<v1::Job> list() const;
  /// The first of them of this kind and session.
  [[nodiscard]] std::optional<v1::Job> find(v1::Job::Kind kind, std::string_view session) const;
  /// Those that run and have reported no progress for longer than `patience`.
  [[nodiscard]] std::vector<v1::Job> hanging(Seconds patience) const;
  /// Waits until the list is empty and all results were passed on; returns at once while background jobs are
  /// paused.
  void drain();

 private:
  struct Entry {
    Job job;
    std::shared_ptr<JobHandle> handle;
  };
  Workers& threads_of(v1::Job::Kind kind);
  /// With the mutex held.
  [[nodiscard]] Status may_add(v1::Job::Kind kind) const;
  void run(const std::shared_ptr<Entry>& entry);

  const JobLimits limits_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::shared_ptr<Entry>> entries_;
  std::size_t telling_ = 0;  ///< number of results being passed on
  std::uint64_t last_id_ = 0;
  bool paused_ = false;
  bool ending_ = false;
  // Last members: their threads use all of the above.
  Workers at_once_;
  Workers asked_;
  Workers background_;
};

/// Whether a daemon in this phase goes on although such a job hangs: frames that are recorded, or wait in
/// memory for the disk, would be lost with it, unless it is the job that should write them.
bool tolerates_hanging(v1::Phase phase, v1::Job::Kind kind);

}  // namespace emberlock::daemon
