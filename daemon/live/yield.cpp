// SPDX-License-Identifier: Apache-2.0
#include "daemon/live/yield.h"

#include <utility>

namespace emberlock::daemon {
namespace {

std::optional<LiveReason> trouble_of(const RecordingLoad& load, bool pauses) {
  if (load.queue_fill > (pauses ? LiveYield::kCalmFill : LiveYield::kPauseFill))
    return QueueFills{load.queue_fill};
  if (load.at_risk > (pauses ? LiveYield::kCalmAtRisk : LiveYield::kPauseAtRisk))
    return DiskBehind{load.at_risk};
  if (load.overworked) return CamerasOverworked{};
  return std::nullopt;
}

}  // namespace

LiveYield::Verdict LiveYield::end(LiveReason reason) {
  reason_ = std::move(reason);
  return verdict_ = Verdict::stop;
}

LiveYield::Verdict LiveYield::look(const RecordingLoad& load, TimePoint now) {
  if (verdict_ == Verdict::stop) return verdict_;
  if (load.lost > 0) return end(FramesLostBeside{load.lost});
  const bool pauses = verdict_ == Verdict::pause;
  if (auto trouble = trouble_of(load, pauses)) {
    calm_since_.reset();
    if (pauses) return verdict_;
    if (++pauses_ > kMostPauses) return end(PausedTooOften{kMostPauses});
    reason_ = std::move(*trouble);
    return verdict_ = Verdict::pause;
  }
  if (!pauses) return verdict_;
  if (!calm_since_) calm_since_ = now;
  if (now - *calm_since_ < kCalm) return verdict_;
  calm_since_.reset();
  reason_ = {};
  return verdict_ = Verdict::run;
}

}  // namespace emberlock::daemon
