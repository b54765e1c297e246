// SPDX-License-Identifier: Apache-2.0
#include "apply/live_flame.h"

#include <utility>

namespace emberlock::apply {

Result<LiveFlame> LiveFlame::load(const LiveScene& scene, recon::Pool& pool) {
  EMBERLOCK_ASSIGN_OR_RETURN(FlamePlayer player, FlamePlayer::load(scene.flame, pool));
  return LiveFlame(std::move(player), scene);
}

LiveFlame::LiveFlame(FlamePlayer player, const LiveScene& scene)
    : player_(std::move(player)),
      marker_(scene.marker),
      lens_(scene.lens),
      lights_(Transfer(scene.curve).lights()),
      composite_(scene.lens, scene.marker, scene.curve, scene.composite),
      track_(scene.lens) {}

/// All dictionaries take a second: seldom, and not while the flame is shown.
void LiveFlame::look_for_others(Seconds time, const Image& frame) {
  constexpr int kLost = 15;
  constexpr Seconds kApart{3};
  if (without_ < kLost || (looked_ && time - *looked_ < kApart)) return;
  looked_ = time;
  instead_ = other_markers(frame.view(), lens_);
}

Result<LiveFlame::Seen> LiveFlame::draw(Seconds time, Image& frame, recon::Pool& pool) {
  if (!began_) began_ = time;
  Seen seen;
  seen.pose = track_.see(time, find_marker(frame.view(), marker_, lens_, &lights_)).seen;
  if (seen.pose.from == TrackedPose::From::marker) {
    without_ = 0;
    looked_.reset();
    instead_.clear();
    composite_.take_white(frame, seen.pose.camera_from_marker);
  } else {
    ++without_;
  }
  seen.without = without_;
  if (seen.pose.from == TrackedPose::From::nothing) {
    look_for_others(time, frame);
    seen.instead = instead_;
    return seen;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const FlamePlayer::Shown* shown, player_.at(time - *began_, pool));
  if (shown != nullptr)
    composite_.draw(*shown->flame, shown->light, seen.pose.camera_from_marker, {}, seen.pose.shown, frame,
                    pool);
  return seen;
}

}  // namespace emberlock::apply
