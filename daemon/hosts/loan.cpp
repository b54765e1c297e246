// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/loan.h"

#include <chrono>
#include <utility>

#include "daemon/hosts/lent_frame.h"

namespace emberlock::daemon {

void LentFrames::offer(const Frame& frame, const drivers::FrameCounts& counts, Seconds apart) {
  const std::lock_guard lock(mutex_);
  if (last_ != TimePoint{} && frame.stamp.monotonic_time - last_ < apart) return;
  last_ = frame.stamp.monotonic_time;
  waiting_.push_back({frame, counts});
  if (waiting_.size() > kQueued) waiting_.pop_front();
  came_.notify_all();
}

void LentFrames::end(Error why) {
  const std::lock_guard lock(mutex_);
  ended_ = std::move(why);
  came_.notify_all();
}

Result<std::optional<v1::LentFrame>> LentFrames::next(Seconds wait) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::duration<double>(wait.value()),
                 [this] { return !waiting_.empty() || ended_; });
  if (waiting_.empty()) {
    if (ended_) return *ended_;
    return std::optional<v1::LentFrame>();
  }
  const Waiting next = std::move(waiting_.front());
  waiting_.pop_front();
  lock.unlock();
  return std::optional(to_proto(next.frame, next.counts));
}

Status Loan::check(const Borrower& borrower, TimePoint now) const {
  if (borrower_.name.empty() || borrower_ == borrower || lapsed(now)) return {};
  if (borrower_.name == borrower.name)
    return Error{ErrorKind::refused,
                 "its cameras are lent to another host that is called " + borrower.name + " too",
                 "emberlockd",
                 "Give one of both rigs another name in [rig], or end the emberlockd that has the cameras"};
  return Error{ErrorKind::refused, "its cameras are lent to " + borrower_.name, "emberlockd",
               "End that one, or wait until it lets go of them: five seconds after it ended, or when what it "
               "records has ended"};
}

Status Loan::take(const Borrower& borrower, TimePoint now) {
  if (borrower.name.empty())
    return Error{ErrorKind::bad_input, "the leader has no name", "leader", "Say who leads"};
  const std::lock_guard lock(mutex_);
  EMBERLOCK_RETURN_IF_ERROR(check(borrower, now));
  borrower_ = borrower;
  heard_ = now;
  return {};
}

Result<bool> Loan::hear(const Borrower& borrower, TimePoint now) {
  const std::lock_guard lock(mutex_);
  if (borrower.name.empty() || borrower.name != borrower_.name || lapsed(now)) return false;
  EMBERLOCK_RETURN_IF_ERROR(check(borrower, now));
  heard_ = now;
  return true;
}

void Loan::hold(bool held) {
  const std::lock_guard lock(mutex_);
  held_ = held;
}

std::string Loan::leader(TimePoint now) const {
  const std::lock_guard lock(mutex_);
  return lapsed(now) ? std::string() : borrower_.name;
}

std::shared_ptr<LentFrames> Loan::watch(std::size_t camera) {
  auto frames = std::make_shared<LentFrames>();
  const std::lock_guard lock(mutex_);
  if (const auto before = watched_.at(camera).lock())
    before->end({ErrorKind::refused, "another one watches the camera", "emberlockd", ""});
  watched_[camera] = frames;
  return frames;
}

void Loan::offer(std::size_t camera, const Frame& frame, const drivers::FrameCounts& counts, Seconds apart) {
  const std::lock_guard lock(mutex_);
  if (const auto frames = watched_.at(camera).lock()) frames->offer(frame, counts, apart);
}

void Loan::fail(std::size_t camera, const Error& why) {
  const std::lock_guard lock(mutex_);
  if (const auto frames = watched_.at(camera).lock()) frames->end(why);
}

}  // namespace emberlock::daemon
