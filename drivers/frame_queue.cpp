// SPDX-License-Identifier: Apache-2.0
#include "drivers/frame_queue.h"

#include <algorithm>
#include <utility>

namespace emberlock::drivers {
namespace {

bool is_frame(const Result<Frame>& waiting) { return waiting.ok(); }

}  // namespace

void FrameQueue::feed(FrameSink sink, const FrameCounts& of_camera) {
  sink_ = std::move(sink);
  if (!sink_) return;
  for (const Result<Frame>& waiting : waiting_) {
    if (!waiting) continue;
    count(*waiting);
    sink_(*waiting, counts(of_camera));
  }
  std::erase_if(waiting_, is_frame);
}

void FrameQueue::add(Frame frame, const FrameCounts& of_camera) {
  if (frame.stamp.monotonic_time <= wanted_from_) {
    ++unreported_;
    return;
  }
  if (sink_) {
    count(frame);
    return sink_(frame, counts(of_camera));
  }
  if (waiting_.size() >= capacity_) {
    if (const auto oldest = std::find_if(waiting_.begin(), waiting_.end(), is_frame);
        oldest != waiting_.end()) {
      waiting_.erase(oldest);
      ++own_.queue;
    }
  }
  waiting_.emplace_back(std::move(frame));
}

std::uint64_t FrameQueue::pass_over(TimePoint until) {
  wanted_from_ = std::max(wanted_from_, until);
  const auto first_wanted = std::find_if(waiting_.begin(), waiting_.end(), [&](const Result<Frame>& waiting) {
    return !waiting || waiting->stamp.monotonic_time > until;
  });
  unreported_ += static_cast<std::uint64_t>(first_wanted - waiting_.begin());
  waiting_.erase(waiting_.begin(), first_wanted);
  own_.passed_over += unreported_;
  return std::exchange(unreported_, 0);
}

void FrameQueue::drop_frames() { own_.passed_over += std::erase_if(waiting_, is_frame); }

void FrameQueue::clear() {
  drop_frames();
  waiting_.clear();
}

std::optional<Result<Frame>> FrameQueue::take() {
  if (waiting_.empty()) return std::nullopt;
  std::optional<Result<Frame>> next = std::move(waiting_.front());
  waiting_.pop_front();
  if (*next) count(**next);
  return next;
}

FrameCounts FrameQueue::counts(const FrameCounts& of_camera) const {
  FrameCounts all = of_camera;
  all.delivered = own_.delivered;
  all.damaged = own_.damaged;
  all.queue += own_.queue;
  all.passed_over += own_.passed_over;
  return all;
}

void FrameQueue::count(const Frame& frame) {
  ++(frame.stamp.status == FrameStatus::complete ? own_.delivered : own_.damaged);
}

}  // namespace emberlock::drivers
