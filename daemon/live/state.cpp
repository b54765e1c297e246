// SPDX-License-Identifier: Apache-2.0
#include "daemon/live/state.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace emberlock::daemon {
namespace {

double sound(double seconds) { return std::isfinite(seconds) ? std::max(seconds, 0.0) : 0; }

}  // namespace

LiveState::LiveState(const std::string& session, const v1::LiveRequest& request) {
  status_.set_session(session);
  status_.set_state(v1::LiveStatus::STARTING);
  status_.set_every(request.every());
  status_.set_voxels(request.voxels());
  status_.set_keeps_up(true);
}

bool LiveState::over() const {
  const v1::LiveStatus::State state = status_.state();
  return state == v1::LiveStatus::STOPPED || state == v1::LiveStatus::ENDED ||
         state == v1::LiveStatus::FAILED;
}

std::optional<v1::IterationPreview> LiveState::take(v1::ChildMessage&& message, TimePoint now) {
  if (over()) return std::nullopt;
  if (message.has_progress() && !message.progress().device().empty())
    status_.set_device(message.progress().device());
  if (message.has_failure()) told_ = message.failure().message();
  if (!message.has_live_frame()) return std::nullopt;
  v1::LiveFrame& frame = *message.mutable_live_frame();
  status_.set_skipped(frame.skipped());
  if (!frame.has_volume() || !is_sound(frame.volume())) {
    status_.set_without_flame(status_.without_flame() + 1);
    no_volume_ = frame.failure();
    return std::nullopt;
  }
  if (status_.state() == v1::LiveStatus::STARTING) status_.set_state(v1::LiveStatus::RUNNING);
  status_.set_volumes(status_.volumes() + 1);
  status_.set_frame(frame.frame());
  const std::int64_t filmed = std::max<std::int64_t>(frame.filmed_ns(), 0);
  status_.set_filmed_ns(filmed);
  status_.set_delay_s(std::max((now - TimePoint{filmed}).value(), 0.0));
  status_.set_voxels(frame.voxels());
  status_.set_takes_s(sound(frame.takes_s()));
  status_.set_keeps_up(frame.keeps_up());
  status_.set_holds_every(frame.holds_every());
  status_.set_holds_voxels(frame.holds_voxels());
  return preview_of(std::move(frame));
}

v1::IterationPreview LiveState::preview_of(v1::LiveFrame&& frame) {
  v1::IterationPreview preview;
  preview.set_reconstruction(name());
  preview.set_frame(frame.frame());
  preview.set_live_delay_s(status_.delay_s());
  preview.mutable_iteration()->set_iteration(1);
  preview.mutable_iteration()->set_seconds(sound(frame.seconds()));
  *preview.mutable_volume() = std::move(*frame.mutable_volume());
  return preview;
}

void LiveState::yield(LiveYield::Verdict verdict, const LiveReason& reason) {
  if (over()) return;
  reason_ = reason;
  if (verdict == LiveYield::Verdict::stop)
    status_.set_state(v1::LiveStatus::STOPPED);
  else if (verdict == LiveYield::Verdict::pause)
    status_.set_state(v1::LiveStatus::PAUSED);
  else
    status_.set_state(status_.volumes() > 0 ? v1::LiveStatus::RUNNING : v1::LiveStatus::STARTING);
}

void LiveState::failed(const ChildEnd& end, const std::string& last_words) {
  if (over()) return;
  status_.set_state(v1::LiveStatus::FAILED);
  reason_ = LiveChildFailed{end, told_, last_words};
}

void LiveState::ended() {
  if (!over()) status_.set_state(v1::LiveStatus::ENDED);
}

LiveReason LiveState::reason() const {
  switch (status_.state()) {
    case v1::LiveStatus::PAUSED:
    case v1::LiveStatus::STOPPED:
    case v1::LiveStatus::FAILED:
      return reason_;
    case v1::LiveStatus::STARTING:
      return no_volume_.empty() ? LiveReason() : NoVolumeYet{no_volume_};
    case v1::LiveStatus::RUNNING:
      if (status_.keeps_up()) return {};
      return TooSlow{Seconds(status_.takes_s()), status_.every(), status_.voxels(), status_.holds_every(),
                     status_.holds_voxels()};
    default:
      return {};
  }
}

}  // namespace emberlock::daemon
