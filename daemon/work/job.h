// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>

#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "emberlock/v1/jobs.pb.h"

namespace emberlock::daemon {

/// The outcome of a job, or why it failed. A cancelled job has the error `refused`.
using JobResult = Result<v1::JobOutcome>;

/// An operation that takes longer than a moment. It runs on a thread of Jobs (jobs.h); its caller doesn't
/// wait.
struct Job {
  v1::Job::Kind kind = v1::Job::KIND_UNSPECIFIED;
  std::string session;  ///< the session it works on
  /// Reports its progress often. When the observer returns false it returns the error `refused`, and leaves
  /// the session in a state from which a later job continues.
  std::function<JobResult(const Observer&)> run;
  /// Called with the result on the job's thread, after the job was removed from the list. Not called if the
  /// daemon's exit cancelled the job.
  std::function<void(const JobResult&)> ended = {};
};

/// A job in progress, as its caller sees it. Thread-safe.
class JobHandle {
 public:
  explicit JobHandle(v1::Job waiting) : state_(std::move(waiting)) {}
  JobHandle(const JobHandle&) = delete;
  JobHandle& operator=(const JobHandle&) = delete;

  [[nodiscard]] v1::Job state() const;
  /// The state, if it has changed since the state with the number `seen`; updates `seen`. 0: any state is
  /// new.
  [[nodiscard]] std::optional<v1::Job> news(std::uint64_t& seen) const;
  /// Empty until the job has ended.
  [[nodiscard]] std::optional<JobResult> result() const;
  /// As result(), after waiting for it at most so long.
  [[nodiscard]] std::optional<JobResult> wait(std::chrono::milliseconds longest) const;
  /// The job ends at its next report of progress; a waiting job never begins. The end of a recording ignores
  /// it.
  void cancel();
  /// `changed` is called after each change of the state, on the thread that makes it. It must return at once
  /// and not call this object. An empty function ends the watch: when this returns, the earlier one isn't
  /// running any more.
  void watch(std::function<void()> changed);

 private:
  friend class Jobs;
  using Steady = std::chrono::steady_clock;

  /// Waits while the job is paused. False: it was cancelled and must not begin.
  bool begin();
  /// Stores the progress, and waits while the job is paused. False: the job must end.
  bool go_on(double fraction, std::string_view doing);
  void end(JobResult result);
  void pause(bool paused);
  void tell();
  [[nodiscard]] v1::Job state_now() const;

  mutable std::mutex mutex_;
  mutable std::condition_variable woken_;
  v1::Job state_;
  std::uint64_t number_ = 1;  ///< of the state
  std::optional<Steady::time_point> began_;
  Steady::time_point told_;
  bool cancelled_ = false;
  bool paused_ = false;
  std::optional<JobResult> result_;

  std::mutex watching_;  ///< held while the watcher is called
  std::function<void()> changed_;
};

}  // namespace emberlock::daemon
