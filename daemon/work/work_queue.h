// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

/// Something that takes long and that nobody waits for.
struct Work {
  v1::BackgroundJob::Kind kind = v1::BackgroundJob::KIND_UNSPECIFIED;
  std::string session;  ///< that it is done to
  /// Asks the observer often; told that nobody wants the rest it ends, with the error `refused`, and leaves
  /// what a later one goes on from.
  std::function<Status(const Observer&)> run;
  /// Told what came of it, on the queue's thread, once the queue has it no more; not of what the queue's
  /// destructor ended or never began.
  std::function<void(const Status&)> done = {};
};

/// Does one piece of work after another, on a thread of the lowest priority (which a piece may spread over
/// more: base/in_parallel.h). Any thread may call, `run` and `done` too.
class WorkQueue {
 public:
  WorkQueue();
  WorkQueue(const WorkQueue&) = delete;
  WorkQueue& operator=(const WorkQueue&) = delete;
  ~WorkQueue();  ///< ends what is in work at its observer's next question

  /// Of one kind and session only one is taken.
  void add(Work work);
  /// While a recording runs: stands still from the observer's next question on.
  void pause();
  void resume();
  /// What is in work first, then what waits.
  [[nodiscard]] std::vector<v1::BackgroundJob> progress() const;
  /// What of this kind is, or will be, done to a session.
  [[nodiscard]] std::optional<v1::BackgroundJob> find(v1::BackgroundJob::Kind kind,
                                                      std::string_view session) const;
  /// Waits until nothing is left to do; not while paused.
  void drain();

 private:
  void work();
  std::optional<Work> next();
  bool go_on(double fraction, std::string_view doing);
  [[nodiscard]] v1::BackgroundJob shown(std::size_t place) const;

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Work> queue_;  ///< the first is in work while working_
  bool working_ = false;
  bool telling_ = false;  ///< what came of the last
  bool paused_ = false;
  bool ending_ = false;
  double fraction_ = 0;
  std::string doing_;
  std::thread thread_;  ///< last: it uses all of the above
};

}  // namespace emberlock::daemon
