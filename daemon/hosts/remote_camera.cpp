// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/remote_camera.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "daemon/hosts/lent_frame.h"
#include "drivers/replay/record.h"

namespace emberlock::daemon {

RemoteCamera::RemoteCamera(std::shared_ptr<RemoteHost> host, drivers::CameraInfo expected)
    : host_(std::move(host)), info_(std::move(expected)) {}

RemoteCamera::~RemoteCamera() { stop(); }

drivers::FrameCounts RemoteCamera::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

Error RemoteCamera::away() const {
  return {ErrorKind::device, "its host doesn't answer", "camera " + info_.id + " at " + host_->address(),
          "See to the host's emberlockd and to the network between; it films on by itself"};
}

Status RemoteCamera::start() {
  {
    const std::lock_guard lock(mutex_);
    const bool streams = thread_.joinable() && !ended_ && SteadyClock().now() - last_ <= kSilence;
    if (streams && host_->connected()) return {};
  }
  stop();
  // What doesn't answer the clock's questions would take this thread's time.
  if (!host_->connected()) return away();
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::LentCameras lent, host_->borrow());
  const auto found = std::find_if(lent.cameras().begin(), lent.cameras().end(), [&](const auto& camera) {
    return camera.stream().camera_id() == info_.id;
  });
  if (found == lent.cameras().end())
    return Error{ErrorKind::device, "it has no such camera", "camera " + info_.id + " at " + host_->address(),
                 "Name one that `emberlock status` lists there"};
  if (found->state() != v1::CameraStatus::FILMING)
    return Error{ErrorKind::device, "it doesn't film", "camera " + info_.id + " at " + host_->address(),
                 "See to it there; it is taken up by itself"};
  // Before it is opened, a camera has no picture's size.
  if (found->stream().width() == 0)
    return Error{ErrorKind::device, "it is just being opened",
                 "camera " + info_.id + " at " + host_->address(), "It is taken up by itself"};
  EMBERLOCK_ASSIGN_OR_RETURN(info_, drivers::camera_info(found->stream()));
  ended_.reset();
  told_.reset();
  last_ = SteadyClock().now();
  call_.emplace();
  thread_ = std::thread([this, id = info_.id] {
    Status end = host_->watch(id, *call_, [this](const v1::LentFrame& lent) { take(lent); });
    const std::lock_guard lock(mutex_);
    ended_ = std::move(end);
    came_.notify_all();
  });
  return {};
}

void RemoteCamera::stop() {
  if (thread_.joinable()) {
    call_->TryCancel();
    thread_.join();
  }
  const std::lock_guard lock(mutex_);
  counts_.passed_over += frames_.size();
  counts_.delivered -= frames_.size();
  frames_.clear();
}

void RemoteCamera::take(const v1::LentFrame& lent) {
  Result<Frame> frame = frame_of(lent, "camera " + info_.id + " at " + host_->address());
  const std::lock_guard lock(mutex_);
  last_ = SteadyClock().now();
  count(counts_of(lent.counts()), lent.damaged());
  if (!frame.ok()) {
    ended_ = frame.error();
    came_.notify_all();
    return;
  }
  frame->stamp.monotonic_time = host_->here(frame->stamp.monotonic_time);
  if (frame->stamp.monotonic_time < wanted_from_) {
    --counts_.delivered;
    ++counts_.passed_over;
    return;
  }
  frames_.push_back(std::move(*frame));
  if (frames_.size() > kQueued) {
    frames_.pop_front();
    --counts_.delivered;
    ++counts_.queue;
  }
  came_.notify_all();
}

/// All frames that the camera made since the last one that came; damaged ones count as delivered here until
/// they are handed on.
void RemoteCamera::count(const drivers::FrameCounts& now, bool damaged) {
  drivers::FrameCounts since{.delivered = damaged ? 0U : 1U, .damaged = damaged ? 1U : 0U};
  // A host that was restarted counts from 0.
  if (told_ && now.made() >= told_->made()) since = now - *told_;
  told_ = now;
  counts_.camera_gap += since.camera_gap;
  counts_.transport += since.transport;
  counts_.resend += since.resend;
  counts_.underrun += since.underrun;
  counts_.queue += since.queue;
  const std::uint64_t made = since.delivered + since.damaged + since.passed_over;
  counts_.passed_over += made > 0 ? made - 1 : 0;
  ++counts_.delivered;
}

Result<Frame> RemoteCamera::next_frame(Seconds deadline) {
  std::unique_lock lock(mutex_);
  came_.wait_for(lock, std::chrono::duration<double>(std::max(deadline, Seconds(0)).value()),
                 [this] { return !frames_.empty() || ended_; });
  if (!frames_.empty()) {
    Frame frame = std::move(frames_.front());
    frames_.pop_front();
    if (frame.stamp.status == FrameStatus::damaged) {
      --counts_.delivered;
      ++counts_.damaged;
    }
    return frame;
  }
  if (ended_) {
    Error error = ended_->ok() ? away() : ended_->error();
    error.kind = ErrorKind::device;
    return error;
  }
  const Seconds silence = SteadyClock().now() - last_;
  lock.unlock();
  const Seconds frame = info_.frame_rate > Hertz(0) ? period(info_.frame_rate) : Seconds(0);
  if (!host_->connected() || silence > std::max(kSilence, 3 * frame)) return away();
  return Error{ErrorKind::timed_out, "no frame came in time",
               "camera " + info_.id + " at " + host_->address(), "Wait longer than a frame period"};
}

std::uint64_t RemoteCamera::pass_over(TimePoint until) {
  const std::lock_guard lock(mutex_);
  const auto old = [&](const Frame& frame) { return frame.stamp.monotonic_time <= until; };
  const auto passed = static_cast<std::uint64_t>(std::erase_if(frames_, old));
  counts_.delivered -= passed;
  counts_.passed_over += passed;
  return passed;
}

Status RemoteCamera::reset_shutter(TimePoint at) {
  EMBERLOCK_RETURN_IF_ERROR(host_->reset(info_.id, at));
  const std::lock_guard lock(mutex_);
  wanted_from_ = std::max(at, SteadyClock().now());
  counts_.passed_over += frames_.size();
  counts_.delivered -= frames_.size();
  frames_.clear();
  return {};
}

Status RemoteCamera::trim_rate(PartsPerMillion trim) { return host_->trim(info_.id, trim); }

}  // namespace emberlock::daemon
