// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/paced_replay.h"

#include <algorithm>
#include <string>
#include <utility>

#include "drivers/replay/record.h"

namespace emberlock::rig {
namespace {

TimePoint first_frame(const session::SessionReader& session) {
  std::optional<TimePoint> first;
  for (std::size_t i = 0; i < session.camera_count(); ++i) {
    if (session.stamps(i).empty()) continue;
    const TimePoint at = session.stamps(i).front().monotonic_time;
    first = std::min(first.value_or(at), at);
  }
  return first.value_or(TimePoint{});
}

}  // namespace

ReplayPace::ReplayPace(const session::SessionReader& session, std::shared_ptr<Clock> clock)
    : clock_(std::move(clock)), first_(first_frame(session)) {}

void ReplayPace::begin() {
  const std::lock_guard lock(mutex_);
  if (!began_) began_ = clock_->now();
}

TimePoint ReplayPace::due(TimePoint recorded) const {
  const std::lock_guard lock(mutex_);
  return began_.value_or(TimePoint{}) + (recorded - first_);
}

PacedCamera::PacedCamera(std::shared_ptr<session::SessionReader> session, std::size_t camera,
                         std::shared_ptr<ReplayPace> pace)
    : session_(std::move(session)),
      camera_(camera),
      pace_(std::move(pace)),
      // Safe: the only possible error is the layout, which the reader has checked.
      info_(drivers::camera_info(session_->manifest().cameras(static_cast<int>(camera))).value()) {
  info_.reset = ShutterReset::none;
  info_.trim.reset();
}

Status PacedCamera::start() {
  pace_->begin();
  filming_ = true;
  return {};
}

Result<Frame> PacedCamera::next_frame(Seconds deadline) {
  if (!filming_)
    return Error{ErrorKind::device, "it does not film", "camera " + info_.id, "start() it first"};
  if (next_ < session_->stamps(camera_).size()) {
    const TimePoint due = pace_->due(session_->stamps(camera_)[next_].monotonic_time);
    const TimePoint until = pace_->clock().now() + deadline;
    pace_->clock().sleep_until(std::min(due, until));
    if (due > until)
      return Error{ErrorKind::timed_out, "no frame in time", "camera " + info_.id, "wait longer"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(Frame frame, session_->read(camera_, next_++));
  const TimePoint due = pace_->due(frame.stamp.monotonic_time);
  frame.stamp.system_time.ns += due.ns - frame.stamp.monotonic_time.ns;
  frame.stamp.monotonic_time = due;
  ++(frame.stamp.status == FrameStatus::complete ? counts_.delivered : counts_.damaged);
  return frame;
}

std::uint64_t PacedCamera::pass_over(TimePoint until) {
  const std::size_t before = next_;
  until = std::min(until, pace_->clock().now());
  const auto& stamps = session_->stamps(camera_);
  while (next_ < stamps.size() && pace_->due(stamps[next_].monotonic_time) <= until) ++next_;
  counts_.passed_over += next_ - before;
  return next_ - before;
}

Error PacedCamera::as_recorded() const {
  return {ErrorKind::device, "what a recorded camera does can't be changed", "camera " + info_.id,
          "replay cameras and strobe alone, or film with a live camera"};
}

Status PacedCamera::reset_shutter(TimePoint /*at*/) { return as_recorded(); }
Status PacedCamera::trim_rate(PartsPerMillion /*trim*/) { return as_recorded(); }

}  // namespace emberlock::rig
