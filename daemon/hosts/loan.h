// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "emberlock/v1/hosts.pb.h"

namespace emberlock::daemon {

/// A camera's frames on their way to the leader: the newest few. Thread-safe.
class LentFrames {
 public:
  static constexpr std::size_t kQueued = 8;

  /// Drops the oldest where the network is too slow, and what comes sooner than `apart` after the last one.
  void offer(const Frame& frame, const drivers::FrameCounts& counts, Seconds apart);
  void end(Error why);
  /// The next frame, waiting at most so long; nothing when none came. Error: the camera's.
  Result<std::optional<v1::LentFrame>> next(Seconds wait);

 private:
  struct Waiting {
    Frame frame;
    drivers::FrameCounts counts;
  };
  std::mutex mutex_;
  std::condition_variable came_;
  std::deque<Waiting> waiting_;
  TimePoint last_;
  std::optional<Error> ended_;
};

/// A host that leads, or wants to: the name that it gives, and the certificate (PEM) that proves who it is.
struct Borrower {
  std::string name;
  std::string certificate;
  friend bool operator==(const Borrower&, const Borrower&) = default;
};

/// Which leader has this host's cameras, and what it watches. A loan belongs to the leader's certificate:
/// another host that gives the same name is refused. A loan lapses when nothing was heard of its leader for
/// kPatience, but not while something is recorded for it. Thread-safe.
class Loan {
 public:
  static constexpr Seconds kPatience{5};

  explicit Loan(std::size_t cameras) : watched_(cameras) {}

  /// Heard of a leader that wants the cameras, or has them. Error refused: another one has them.
  Status take(const Borrower& borrower, TimePoint now);
  /// Heard of one that only asks for the clock or for a part: whether the cameras are lent to it. Error
  /// refused: they are lent to another one of its name.
  Result<bool> hear(const Borrower& borrower, TimePoint now);
  /// Whether something is recorded for the leader.
  void hold(bool held);
  /// Empty: nobody.
  [[nodiscard]] std::string leader(TimePoint now) const;

  /// Another watcher of a camera takes the place of the one before.
  std::shared_ptr<LentFrames> watch(std::size_t camera);
  void offer(std::size_t camera, const Frame& frame, const drivers::FrameCounts& counts, Seconds apart);
  void fail(std::size_t camera, const Error& why);

 private:
  [[nodiscard]] bool lapsed(TimePoint now) const { return !held_ && now - heard_ > kPatience; }

  /// Requires the lock. Error refused: another one has the cameras.
  [[nodiscard]] Status check(const Borrower& borrower, TimePoint now) const;

  mutable std::mutex mutex_;
  Borrower borrower_;
  TimePoint heard_;
  bool held_ = false;
  std::vector<std::weak_ptr<LentFrames>> watched_;  ///< by camera
};

}  // namespace emberlock::daemon
