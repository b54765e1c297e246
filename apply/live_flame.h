// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <string>

#include "apply/composite.h"
#include "apply/flame_player.h"
#include "apply/marker.h"
#include "apply/pose_track.h"
#include "base/image.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/compute/pool.h"

namespace emberlock::apply {

/// What stands where, and how it is drawn.
struct LiveScene {
  StandingFlame flame;
  Marker marker;
  recon::Intrinsics lens;  ///< of the frames
  Transfer::Curve curve = Transfer::Curve::srgb;
  CompositeOptions composite = {};
};

/// A flame on a marker while a camera films: nothing lies ahead, so that poses are those of PoseTrack::see().
class LiveFlame {
 public:
  /// Errors: those of FlamePlayer::load().
  static Result<LiveFlame> load(const LiveScene& scene, recon::Pool& pool);

  struct Seen {
    TrackedPose pose;
    int without = 0;           ///< frames since the marker was seen
    std::string instead = {};  ///< while it isn't: other_markers(), as it was looked for last
  };
  /// Draws into the next frame, rgb8, later than the one before. Errors: those of FlamePlayer::at().
  Result<Seen> draw(Seconds time, Image& frame, recon::Pool& pool);

 private:
  LiveFlame(FlamePlayer player, const LiveScene& scene);
  void look_for_others(Seconds time, const Image& frame);

  FlamePlayer player_;
  Marker marker_;
  recon::Intrinsics lens_;
  std::array<float, 256> lights_;
  Composite composite_;
  PoseTrack track_;
  std::optional<Seconds> began_;
  std::optional<Seconds> looked_;  ///< for other markers
  int without_ = 0;
  std::string instead_;
};

}  // namespace emberlock::apply
