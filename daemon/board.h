// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "emberlock/v1/services.pb.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

/// Ends a subscription when it goes. Its function is not running, and won't, once the destructor has
/// returned.
class Subscription {
 public:
  Subscription() = default;
  explicit Subscription(std::function<void()> end) : end_(std::move(end)) {}
  Subscription(Subscription&& other) noexcept : end_(std::exchange(other.end_, {})) {}
  Subscription& operator=(Subscription&& other) noexcept {
    std::swap(end_, other.end_);
    return *this;
  }
  ~Subscription() {
    if (end_) end_();
  }

 private:
  std::function<void()> end_;
};

/// What the daemon shows, for any number of watchers: of status and pictures the newest alone, so that a slow
/// watcher misses what was overtaken and holds nobody up. Thread-safe.
class Board {
 public:
  enum class Topic { status, notices, pictures, iterations };
  static constexpr std::size_t kNotices = 1000;  ///< so many are kept

  /// Gives it the next revision. What it says in words is shown as sentences, as notices are.
  void show(v1::DaemonStatus status);
  /// Never null.
  [[nodiscard]] std::shared_ptr<const v1::DaemonStatus> status() const;

  /// Adds a line to the journal, with the next id and the time.
  void notice(v1::Light light, const std::string& text);
  [[nodiscard]] std::vector<v1::Notice> notices(std::uint64_t after) const;

  /// Dropped while nobody wants pictures.
  void show(std::shared_ptr<const v1::Picture> picture);
  /// The newest of each camera, by camera id.
  [[nodiscard]] std::map<std::string, std::shared_ptr<const v1::Picture>> pictures() const;

  /// Forgets those of another reconstruction, and of another frame of a sequence.
  void show(std::shared_ptr<const v1::IterationPreview> preview);
  /// Of the running or last reconstruction (of a sequence its frame at hand) those from the `from`th on
  /// (counted from 0), in order; only the newest that came with pictures and volume still has them.
  [[nodiscard]] std::vector<std::shared_ptr<const v1::IterationPreview>> iterations(std::size_t from) const;

  /// `changed` is called after each change, from whichever thread makes it: it must return at once, and call
  /// nothing of the board's but what is const.
  [[nodiscard]] Subscription subscribe(std::function<void(Topic)> changed);
  /// Whether anybody wants pictures: only then are they made. With the last who wants them the pictures go.
  [[nodiscard]] Subscription want_pictures();
  [[nodiscard]] bool pictures_wanted() const;

 private:
  void tell(Topic topic);

  mutable std::mutex mutex_;
  std::shared_ptr<const v1::DaemonStatus> status_ = std::make_shared<v1::DaemonStatus>();
  std::uint64_t revision_ = 0;
  std::deque<v1::Notice> notices_;
  std::uint64_t next_notice_ = 1;
  std::map<std::string, std::shared_ptr<const v1::Picture>> pictures_;
  std::vector<std::shared_ptr<const v1::IterationPreview>> iterations_;
  int picture_watchers_ = 0;

  std::mutex telling_;  ///< held while subscribers are called, so that none is called after it ended
  std::map<std::uint64_t, std::function<void(Topic)>> subscribers_;
  std::uint64_t next_subscriber_ = 0;
};

}  // namespace emberlock::daemon
