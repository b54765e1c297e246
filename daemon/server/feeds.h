// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>

#include "base/time_point.h"
#include "daemon/board.h"

// What one watcher still has to receive of each kind of data on the board. A feed stores only the watcher's
// position: the board is a mailbox with one slot for the status and one for each camera, so a slow watcher
// uses no memory and misses what was replaced meanwhile. The watcher asks when it can accept another message.
// Not thread-safe; times are on the host's monotonic clock.
namespace emberlock::daemon {

template <class Message>
struct Next {
  std::shared_ptr<const Message> message = {};  ///< null: nothing now
  std::optional<TimePoint> again =
      {};  ///< without a message: when there will be one even if the board doesn't change
};

/// The part of the status that watchers get ten times a second: without the rounds' history, which is long
/// and seldom changes.
v1::DaemonStatus without_history(const v1::DaemonStatus& status);

/// The status, whenever its history has changed.
class HistoryFeed {
 public:
  explicit HistoryFeed(const Board& board) : board_(board) {}
  Next<v1::DaemonStatus> next(TimePoint now);

 private:
  /// Identifies a history: each alignment starts a new one, and rounds are only appended.
  struct Last {
    int rounds = 0;
    std::uint32_t round = 0;
    double at_s = 0;
    bool operator==(const Last&) const = default;
  };
  const Board& board_;
  Last told_;
};

/// The status when it has changed, at most ten times a second.
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

/// All notices after `after`, in order.
class NoticeFeed {
 public:
  NoticeFeed(const Board& board, std::uint64_t after) : board_(board), after_(after) {}
  Next<v1::Notice> next(TimePoint now);

 private:
  const Board& board_;
  std::uint64_t after_;
  std::deque<v1::Notice> read_;  ///< at most as many as the board keeps
};

/// The newest picture of each camera, never older than the previous one; cameras take turns. Pictures are
/// made only while such a feed exists.
class PictureFeed {
 public:
  static constexpr double kRateHz = 12;
  static constexpr double kEarly = 0.2;  ///< periods by which a picture may be early, because cameras jitter

  PictureFeed(Board& board, const v1::WatchPicturesRequest& request);
  Next<v1::Picture> next(TimePoint now);

 private:
  struct Last {
    std::shared_ptr<const v1::Picture> picture;
    TimePoint due;  ///< of the next picture
  };
  Board& board_;
  std::set<std::string> cameras_;  ///< empty: all
  Seconds apart_;
  std::map<std::string, Last> last_;
  Subscription wanted_;
};

/// All iterations of the running or last reconstruction, then of the next one.
class IterationFeed {
 public:
  explicit IterationFeed(const Board& board) : board_(board) {}
  Next<v1::IterationPreview> next(TimePoint now);

 private:
  const Board& board_;
  std::string reconstruction_;
  std::uint64_t frame_ = 0;  ///< of a sequence
  std::size_t seen_ = 0;
};

}  // namespace emberlock::daemon
