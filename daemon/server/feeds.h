// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "base/time_point.h"
#include "daemon/board.h"

// What one watcher still has to be told, of each kind of thing on the board. A feed holds nothing but how far
// its watcher is: the board is the mailbox, with one slot for the status and one for each camera, so a slow
// watcher costs no memory and misses what was overtaken. The watcher asks when it can take one more message.
// Not thread-safe; times are on the host's monotonic clock.
namespace emberlock::daemon {

template <class Message>
struct Next {
  std::shared_ptr<const Message> message = {};  ///< null: nothing now
  std::optional<TimePoint> again =
      {};  ///< of no message: when there will be one without a change of the board
};

/// What watchers are told ten times a second: without what is long and seldom changes, the rounds' history.
v1::DaemonStatus without_history(const v1::DaemonStatus& status);

/// A status whose history changed, whenever that did.
class HistoryFeed {
 public:
  explicit HistoryFeed(const Board& board) : board_(board) {}
  Next<v1::DaemonStatus> next(TimePoint now);

 private:
  /// Tells histories apart: each alignment begins its own, and a round is added at their end alone.
  struct Last {
    int rounds = 0;
    std::uint32_t round = 0;
    double at_s = 0;
    bool operator==(const Last&) const = default;
  };
  const Board& board_;
  Last told_;
};

/// The status when it changed, ten times a second at most.
class StatusFeed {
 public:
  static constexpr Seconds kApart{0.1};
  explicit StatusFeed(const Board& board) : board_(board) {}
  Next<v1::DaemonStatus> next(TimePoint now);

 private:
  const Board& board_;
  std::optional<std::uint64_t> revision_;
  TimePoint at_;
};

/// Every notice after `after`, in order.
class NoticeFeed {
 public:
  NoticeFeed(const Board& board, std::uint64_t after) : board_(board), after_(after) {}
  Next<v1::Notice> next(TimePoint now);

 private:
  const Board& board_;
  std::uint64_t after_;
  std::deque<v1::Notice> read_;  ///< at most what the board keeps
};

/// The newest picture of each camera, no older than the one before; the camera served longest ago first.
/// While it lives, pictures are made.
class PictureFeed {
 public:
  static constexpr double kRateHz = 12;
  static constexpr double kEarly = 0.2;  ///< periods before it is due that a picture is taken: cameras jitter

  PictureFeed(Board& board, const v1::WatchPicturesRequest& request);
  Next<v1::Picture> next(TimePoint now);

 private:
  struct Last {
    std::shared_ptr<const v1::Picture> picture;
    TimePoint due;  ///< of the next one
  };
  Board& board_;
  std::set<std::string> cameras_;  ///< empty: all
  Seconds apart_;
  std::map<std::string, Last> last_;
  Subscription wanted_;
};

/// The iterations of the running or last reconstruction from its first one on, and then of the next.
class IterationFeed {
 public:
  explicit IterationFeed(const Board& board) : board_(board) {}
  Next<v1::IterationPreview> next(TimePoint now);

 private:
  const Board& board_;
  std::string reconstruction_;
  std::size_t seen_ = 0;
};

}  // namespace emberlock::daemon
