// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"
#include "recon/calibrate/chain_poses.h"

namespace emberlock::recon {

/// A camera that the others' solution doesn't describe.
struct Misfit {
  std::size_t camera = 0;  ///< index in BoardSightings.cameras
  bool mirrored = false;   ///< its pictures are mirror images
  std::string why;         ///< the reason, and what to do
};

/// The cameras to leave out of a solved group: none if every camera's lens is as lens_misfit() demands and
/// most of the `placed` views that it shares with others are used with theirs. Otherwise those that agree
/// with few others at the instants that they share, else the one that fits worst. Of two cameras that
/// disagree the second is named. `placed` holds each view's pose from its camera's own lens.
std::vector<Misfit> find_misfits(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses,
                                 const std::vector<PlacedSighting>& placed, const RigCalibration& result);

}  // namespace emberlock::recon
